//! Errors as the program says them: what the library found, and the flag that resolves it.

use dose3::Error;
use dose3::error::Setting;
use dose3::logs::Note;
use dose3_datasets::{ReadOption, Remark};

/// The whole error in one line, with a hint where a flag of this program helps.
pub fn explain(error: &anyhow::Error) -> String {
    let mut text = String::new();
    for cause in error
        .chain()
        .map(|cause| without_numbers_of_the_system(&cause.to_string()))
    {
        // Many messages hold their cause already.
        if !text.ends_with(&cause) {
            text = match text.is_empty() {
                true => cause,
                false => format!("{text}: {cause}"),
            };
        }
    }
    let known = error.chain().find_map(|c| c.downcast_ref::<Error>());
    // An error of reading has its hint, which lacks only the flag.
    if let Some(option) = known.and_then(read_option) {
        return format!("{text} ({})", flag_of_reading(option));
    }
    match known.and_then(hint) {
        Some(hint) => format!("{text}; hint: {hint}"),
        None => text,
    }
}

/// Without the number that the operating system gives its errors: `No such file or directory (os error 2)`.
fn without_numbers_of_the_system(text: &str) -> String {
    let mut parts = text.split(" (os error ");
    let mut out = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        out.push_str(part.split_once(')').map_or("", |(_, rest)| rest));
    }
    out
}

/// A remark on how a log was read, with the flag that decides it.
pub fn remark_with_flag(remark: &Remark) -> String {
    match remark.option {
        Some(option) => format!("{remark} ({})", flag_of_reading(option)),
        None => remark.to_string(),
    }
}

/// A note of the library with the flag that changes what it says.
pub fn with_flag(note: &Note) -> String {
    match note {
        Note::NominalRate { .. } => format!("{note} (--nominal-rate changes it)"),
        Note::UnknownAxes => format!("{note} (--frame names the axes)"),
        _ => note.to_string(),
    }
}

/// What a user of the program can do about an error of the library.
fn hint(error: &Error) -> Option<String> {
    Some(match error {
        Error::File { reason, .. } | Error::Log { reason, .. } | Error::Backend { reason, .. } => {
            return hint(reason);
        }
        Error::LogForDetector { .. } => {
            "fit one to trusted logs with `dose3 fit --trusted DIR --out DETECTOR`, \
                                         give that to --detector and the log beside it"
                .into()
        }
        Error::NotADetector => "make a detector of it with `dose3 fit --model`".into(),
        Error::Setting { setting, .. } => format!("it is set by {}", flag(*setting)?),
        Error::UnknownName { what: "log", .. } => "logs are held out with --hold-out".into(),
        Error::AllHeldOut { .. } => "--hold-out names the logs held out".into(),
        Error::UnknownRate { .. } => "name it with --rate".into(),
        Error::HasStamps { .. } => "leave --nominal-rate out".into(),
        Error::Frame { .. } => "name them with --frame (camera-rdf, body-frd, body-flu, object \
                                or sensor)"
            .into(),
        Error::MixedFrames { .. } => "--frame names the body axes of all logs".into(),
        Error::MixedRates { expected, .. } => format!("--resample {expected:.1} resamples"),
        Error::NotMetres { .. } => {
            "name the unit of its positions with --unit (0.001 for millimetres)".into()
        }
        Error::TooSlow { found, nominal, .. } => {
            let named = match nominal {
                true => "if that is not its rate, name it with --nominal-rate, else ",
                false => "",
            };
            format!("{named}fit at a rate that all logs reach (fit --resample {found:.4})")
        }
        Error::MissingBackend { feature, .. } => format!("rebuild with `--features {feature}`"),
        _ => return None,
    })
}

/// The setting of reading that an error points to.
fn read_option(error: &Error) -> Option<ReadOption> {
    match error {
        Error::Data(error) => error.read_option(),
        Error::Log { reason, .. } => read_option(reason),
        _ => None,
    }
}

/// The flag for a setting of reading.
fn flag_of_reading(option: ReadOption) -> String {
    match option {
        ReadOption::Tf => "--tf PARENT:CHILD".into(),
        other => format!("--{}", other.name()),
    }
}

fn flag(setting: Setting) -> Option<&'static str> {
    Some(match setting {
        Setting::Unit => "--unit",
        Setting::NominalRate => "--nominal-rate",
        Setting::Steps => "--steps",
        Setting::Draws => "--draws",
        Setting::Stride => "--stride",
        Setting::MeasuringRate => "--resample",
        Setting::Window => "--window",
        Setting::Alpha => "--alpha",
        Setting::Rate => "--rate",
        Setting::Gap => "--max-gap",
        Setting::Reset => "--reset",
        Setting::AlarmsPerHour => "--alarms-per-hour",
        Setting::Every => "--every",
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::explain;
    use dose3::Error;

    #[test]
    fn errors_of_the_system_are_said_in_words() {
        let missing = std::io::Error::from_raw_os_error(2);
        let error = anyhow::Error::from(missing).context("cannot read a.txt");
        assert_eq!(
            explain(&error),
            "cannot read a.txt: No such file or directory"
        );
    }

    #[test]
    fn a_cause_is_said_once_and_the_flag_is_named() {
        let error = Error::HasStamps {
            log: "a".into(),
            hertz: 10.0,
        };
        let error = anyhow::Error::from(error.of_log("a.txt")).context("while reading");
        assert_eq!(
            explain(&error),
            "while reading: log a.txt: log a has stamps, which say 10.0000 Hz; a nominal rate is for \
             logs without; hint: leave --nominal-rate out"
        );
    }
}
