//! A server on loopback that answers every request with the same bytes, and counts them.

use std::io::{Read, Write};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::thread::JoinHandle;

/// What the server sends.
pub struct Reply {
    /// Head and body.
    pub bytes: Vec<u8>,
    /// Keep the connection open and silent afterwards.
    pub stall: bool,
}

impl Reply {
    /// `200 OK` with the whole body.
    pub fn ok(body: &[u8]) -> Self {
        Self::announcing(body.len(), body)
    }

    /// `200 OK` that promises `length` bytes, whatever the body has.
    pub fn announcing(length: usize, body: &[u8]) -> Self {
        let head =
            format!("HTTP/1.1 200 OK\r\nContent-Length: {length}\r\nConnection: close\r\n\r\n");
        Self {
            bytes: [head.as_bytes(), body].concat(),
            stall: false,
        }
    }

    /// `200 OK` whose body ends where the connection does.
    pub fn unannounced(body: &[u8]) -> Self {
        let head: &[u8] = b"HTTP/1.1 200 OK\r\nConnection: close\r\n\r\n";
        Self {
            bytes: [head, body].concat(),
            stall: false,
        }
    }

    /// Any answer without a body.
    pub fn status(status: &str) -> Self {
        let head = format!("HTTP/1.1 {status}\r\nContent-Length: 0\r\nConnection: close\r\n\r\n");
        Self {
            bytes: head.into_bytes(),
            stall: false,
        }
    }

    /// The same, never closing the connection.
    pub fn then_stall(self) -> Self {
        Self {
            stall: true,
            ..self
        }
    }
}

/// Runs until it is dropped.
pub struct Server {
    address: SocketAddr,
    requests: Arc<AtomicUsize>,
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Server {
    pub fn start(reply: Reply) -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let address = listener.local_addr().unwrap();
        let requests = Arc::new(AtomicUsize::new(0));
        let stop = Arc::new(AtomicBool::new(false));
        let (counter, stopped) = (Arc::clone(&requests), Arc::clone(&stop));
        let thread = std::thread::spawn(move || {
            let mut held = Vec::new();
            for stream in listener.incoming() {
                if stopped.load(Ordering::SeqCst) {
                    break;
                }
                counter.fetch_add(1, Ordering::SeqCst);
                held.extend(answer(stream.unwrap(), &reply));
            }
        });
        Self {
            address,
            requests,
            stop,
            thread: Some(thread),
        }
    }

    pub fn url(&self) -> String {
        format!("http://{}/data_odometry_poses.zip", self.address)
    }

    pub fn requests(&self) -> usize {
        self.requests.load(Ordering::SeqCst)
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::SeqCst);
        // Wakes the thread where it waits for a connection.
        let _ = TcpStream::connect(self.address);
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

/// Reads the request to its blank line and replies; returns the connection where it is to stay open.
fn answer(mut stream: TcpStream, reply: &Reply) -> Option<TcpStream> {
    let mut request = Vec::new();
    let mut buffer = [0; 1024];
    while !request.windows(4).any(|end| end == b"\r\n\r\n") {
        match stream.read(&mut buffer) {
            Ok(0) | Err(_) => return None,
            Ok(count) => request.extend_from_slice(&buffer[..count]),
        }
    }
    // The client may hang up early, as it does at its ceiling.
    let _ = stream.write_all(&reply.bytes);
    reply.stall.then_some(stream)
}
