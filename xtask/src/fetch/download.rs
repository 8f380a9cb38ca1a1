//! One file over HTTP into a temporary file, with limits on time and size.

use std::fs::File;
use std::io::{self, ErrorKind, Read, Seek, Write};
use std::time::Duration;

use anyhow::{Context, Result, anyhow, bail};
use indicatif::{ProgressBar, ProgressStyle};
use ureq::Agent;

/// How long to wait, how much to take, and by which way.
#[derive(Debug, Clone, Copy)]
pub struct Transport {
    /// For the connection, TLS included.
    pub connect: Duration,
    /// From the request to the end of the response's headers.
    pub response: Duration,
    /// For any single read; a server that falls silent is given up after this.
    pub stall: Duration,
    /// For everything together.
    pub total: Duration,
    /// Largest body in bytes.
    pub ceiling: u64,
    /// Honour `HTTPS_PROXY` and its relatives.
    pub proxy: bool,
    /// Show a progress bar (on stderr, and only where that is a terminal).
    pub progress: bool,
}

impl Default for Transport {
    fn default() -> Self {
        Self {
            connect: Duration::from_secs(20),
            response: Duration::from_secs(30),
            stall: Duration::from_secs(30),
            total: Duration::from_secs(900),
            ceiling: 64 << 20,
            proxy: true,
            progress: true,
        }
    }
}

/// Downloads `url` into an unnamed temporary file, positioned at its start.
///
/// The file has no path: the operating system frees it even where the task is killed.
///
/// # Errors
/// No connection, a status other than 200, a body that ends early or exceeds the ceiling, a server
/// that falls silent, a full disk.
pub fn to_temporary(url: &str, transport: &Transport) -> Result<File> {
    let mut response = agent(transport).get(url).call().map_err(explain)?;
    let status = response.status();
    if status != 200 {
        bail!("the server answered with HTTP status {status} instead of the file");
    }
    let announced = response.body().content_length();
    if let Some(size) = announced.filter(|size| *size > transport.ceiling) {
        bail!(
            "the server announces {size} bytes, more than the ceiling of {}",
            transport.ceiling
        );
    }
    let bar = progress_bar(announced, transport.progress);
    let mut file = tempfile::tempfile().context("cannot create a temporary file")?;
    let mut body = response.body_mut().as_reader();
    let mut buffer = vec![0; 64 << 10];
    let mut received = 0_u64;
    loop {
        let count = match body.read(&mut buffer) {
            Ok(0) => break,
            Ok(count) => count,
            Err(error) if error.kind() == ErrorKind::Interrupted => continue,
            Err(error) => return Err(cut_off(error, received, announced)),
        };
        received += count as u64;
        if received > transport.ceiling {
            bail!(
                "the file is larger than the ceiling of {} bytes",
                transport.ceiling
            );
        }
        file.write_all(&buffer[..count])
            .context("cannot write a temporary file")?;
        bar.set_position(received);
    }
    bar.finish_and_clear();
    file.rewind().context("cannot read a temporary file")?;
    Ok(file)
}

fn agent(transport: &Transport) -> Agent {
    let config = Agent::config_builder()
        // A status is answered in one place, with its text.
        .http_status_as_error(false)
        .timeout_connect(Some(transport.connect))
        .timeout_recv_response(Some(transport.response))
        .timeout_per_read(Some(transport.stall))
        .timeout_per_write(Some(transport.stall))
        .timeout_global(Some(transport.total))
        .user_agent(concat!("dose3-xtask/", env!("CARGO_PKG_VERSION")));
    let config = if transport.proxy {
        config
    } else {
        config.proxy(None)
    };
    config.build().new_agent()
}

fn progress_bar(size: Option<u64>, visible: bool) -> ProgressBar {
    if !visible {
        return ProgressBar::hidden();
    }
    let (bar, template) = match size {
        Some(size) => (
            ProgressBar::new(size),
            "{bar:40} {bytes}/{total_bytes} {bytes_per_sec} {eta}",
        ),
        None => (
            ProgressBar::new_spinner(),
            "{spinner} {bytes} {bytes_per_sec}",
        ),
    };
    match ProgressStyle::with_template(template) {
        Ok(style) => bar.with_style(style),
        Err(_) => bar,
    }
}

/// The body ended where it should not.
fn cut_off(error: io::Error, received: u64, announced: Option<u64>) -> anyhow::Error {
    let of = announced.map_or_else(String::new, |size| format!(" of {size}"));
    if error.kind() == ErrorKind::UnexpectedEof {
        return anyhow!("the connection was closed after {received}{of} bytes; run it again");
    }
    // The reader wraps the client's own errors, timeouts among them.
    explain(ureq::Error::from(error)).context(format!("stopped after {received}{of} bytes"))
}

/// Says what a person can do about an error of the client.
fn explain(error: ureq::Error) -> anyhow::Error {
    let advice = match &error {
        ureq::Error::HostNotFound => {
            "the host name is not known here; is there a network connection?".to_owned()
        }
        ureq::Error::Timeout(phase) => {
            format!("no answer within the time limit ({phase}); try again later")
        }
        ureq::Error::Io(cause) => match cause.kind() {
            ErrorKind::ConnectionRefused => "the connection was refused".to_owned(),
            ErrorKind::ConnectionReset
            | ErrorKind::ConnectionAborted
            | ErrorKind::UnexpectedEof => {
                "the server closed the connection without an answer".to_owned()
            }
            _ => "no connection; is there a network, or does it need HTTPS_PROXY?".to_owned(),
        },
        ureq::Error::ConnectionFailed => {
            "no connection; is there a network, or does it need HTTPS_PROXY?".to_owned()
        }
        ureq::Error::BadUri(_) => "this is no http or https address".to_owned(),
        _ => "the request failed".to_owned(),
    };
    anyhow::Error::new(error).context(advice)
}
