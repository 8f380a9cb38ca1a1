//! `cargo xtask train-joint`: the weights of the joint network.

use crate::use_threads;
use anyhow::Result;
use clap::Args;
use dose3::backend::{Backend, Computing};
use dose3_diffusion::joint::JointTrainConfig;
use dose3_model::Precision;
use dose3_model::joint::JointConfig;
use dose3_study::data::DataRoot;
use dose3_study::joint::{JointData, train, untrained};
use dose3_study::say;
use std::path::PathBuf;
use std::time::Instant;

/// Arguments of `train-joint`.
#[derive(Clone, Debug, Args)]
pub struct JointArgs {
    /// Folder with the data sets (default: $DOSE3_DATA, else data/)
    #[arg(long, value_name = "DIR")]
    pub data: Option<PathBuf>,
    /// File to write; `dose3 fit --model FILE` and `benchmark --model FILE` take it
    #[arg(long, value_name = "FILE", default_value = "joint.dose3")]
    pub out: PathBuf,
    /// Optimiser steps
    #[arg(long, default_value_t = JointTrainConfig::default().steps)]
    pub steps: usize,
    /// Sequences a step
    #[arg(long, default_value_t = JointTrainConfig::default().batch)]
    pub batch: usize,
    /// Channels
    #[arg(long, default_value_t = 48)]
    pub width: usize,
    /// Steps between the taps of each block
    #[arg(long, value_delimiter = ',', default_value = "1,2,4,8,1,2,4,8")]
    pub dilations: Vec<usize>,
    /// Peak learning rate
    #[arg(long, default_value_t = JointTrainConfig::default().learning_rate)]
    pub rate: f64,
    /// Leave out the synthetic logs
    #[arg(long)]
    pub no_synthetic: bool,
    /// Write the network as it is before training, to compare with
    #[arg(long, conflicts_with_all = ["steps", "batch", "rate", "no_synthetic", "backend"])]
    pub untrained: bool,
    /// Seed
    #[arg(long, default_value_t = 0)]
    pub seed: u64,
    /// Keep weights as f32 instead of f16
    #[arg(long)]
    pub full_precision: bool,
    /// Where to train
    #[arg(long, value_name = "BACKEND", default_value_t)]
    pub backend: Backend,
    /// Threads (0: all cores); results do not depend on it
    #[arg(long, default_value_t = 0)]
    pub threads: usize,
}

/// Trains on real and synthetic logs and writes the weights.
///
/// # Errors
/// Without the data, or where training fails.
pub fn run(args: &JointArgs) -> Result<()> {
    use_threads(args.threads)?;
    let config = JointTrainConfig {
        steps: args.steps,
        batch: args.batch,
        learning_rate: args.rate,
        seed: args.seed,
        ..JointTrainConfig::default()
    };
    let network = JointConfig::new(args.width, &args.dilations);
    let precision = match args.full_precision {
        true => Precision::F32,
        false => Precision::F16,
    };
    if args.untrained {
        untrained(&network, &config)?.write(&args.out, precision)?;
        say!("wrote {}, untrained", args.out.display());
        return Ok(());
    }
    let root = DataRoot::find(args.data.as_deref())?;
    let longest = config.lengths.iter().copied().max().unwrap_or(1);
    let data = JointData::read(&root, longest, !args.no_synthetic)?;
    for (record, set) in data.records.iter().zip(&data.training) {
        let steps: usize = set.sequences.iter().map(Vec::len).sum();
        say!(
            "{} at {} Hz: {} logs, {steps} steps, scale {:.4?}",
            record.name,
            record.rate,
            record.logs.len(),
            set.scale
        );
    }
    say!("{} parameters", network.layout().len());
    let start = Instant::now();
    let (mut sum, mut count) = (0.0, 0.0);
    let computing = Computing {
        backend: args.backend,
        threads: args.threads,
    };
    let model = train(&network, &config, data, computing, &mut |row, validated| {
        let over = row.over as f64;
        (sum, count) = (sum + over * row.loss, count + over);
        if row.step.is_multiple_of(100) || row.step == config.steps {
            say!(
                "step {} of {}: {:.4} ({:.0} s)",
                row.step,
                config.steps,
                sum / count,
                start.elapsed().as_secs_f64()
            );
            (sum, count) = (0.0, 0.0);
        }
        if let Some(errors) = validated {
            say!("validation at step {}, each set: {errors:.4?}", row.step);
        }
    })?;
    model.write(&args.out, precision)?;
    say!(
        "wrote {}; validation {:?}",
        args.out.display(),
        model.header.validation
    );
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::Parser;

    #[derive(Parser)]
    struct Line {
        #[command(flatten)]
        args: JointArgs,
    }

    #[test]
    fn the_backend_is_named_as_by_train() {
        let parse = |line: &[&str]| Line::try_parse_from([&["train-joint"], line].concat());
        assert_eq!(parse(&[]).unwrap().args.backend, Backend::Engine);
        for backend in Backend::ALL {
            let named = parse(&["--backend", &backend.to_string()]).unwrap();
            assert_eq!(named.args.backend, backend);
        }
        assert!(parse(&["--backend", "gpu"]).is_err());
    }
}
