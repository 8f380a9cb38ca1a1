//! The networks behind the tables of `benchmark --all`, which lie in `crates/study/weights`.

use crate::release::{ReleaseArgs, run};
use anyhow::{Context, Result, bail};
use dose3::built_in;
use dose3::model_file::Model;
use std::path::{Path, PathBuf};

/// A network: its name, and how `cargo xtask train-release-model` is called for it.
#[derive(Clone, Copy, Debug)]
pub struct Network {
    /// Name of its file.
    pub name: &'static str,
    /// Arguments of `train-release-model`.
    pub arguments: &'static str,
}

/// The shipped model of the paper's protocol, training seed 0.
pub const KITTI: &str = "kitti";

/// Networks beside the shipped one. The comparisons of training sets, lengths, steps and readings are
/// between networks of 1,500 optimiser steps which see the same number of poses a step.
pub const NETWORKS: [Network; 14] = [
    network("kitti-seed1", "--seed 1"),
    network("kitti-seed2", "--seed 2"),
    network("kitti-1500", "--steps 1500"),
    network("robotcar-1500", "--steps 1500 --set O"),
    network("iros20-1500", "--steps 1500 --set I"),
    network("kitti-length64", "--steps 1500 --window 64 --batch 128"),
    network("kitti-length256", "--steps 1500 --window 256 --batch 32"),
    network("kitti-length512", "--steps 1500 --window 512 --batch 16"),
    network("kitti-steps5", "--steps 1500 --diffusion-steps 5"),
    network("kitti-steps10", "--steps 1500 --diffusion-steps 10"),
    network("kitti-steps15", "--steps 1500 --diffusion-steps 15"),
    network("kitti-linear", "--steps 1500 --rotation-schedule linear"),
    network("kitti-onescale", "--steps 1500 --one-scale"),
    network("kitti-motion", "--steps 1500 --recipe motion --set K"),
];

const fn network(name: &'static str, arguments: &'static str) -> Network {
    Network { name, arguments }
}

/// Where the networks lie, seen from the root of the workspace.
pub const FOLDER: &str = "crates/study/weights";

/// The file of a network.
pub fn file(name: &str) -> PathBuf {
    Path::new(FOLDER).join(format!("{name}.dose3"))
}

/// The network of that name.
///
/// # Errors
/// A name that none has; a file that is missing or cannot be read, with the command that makes it.
pub fn load(name: &str) -> Result<Model> {
    if name == KITTI {
        return Ok(built_in::paper()?);
    }
    find(name)?;
    Model::read(&file(name)).with_context(|| {
        format!("`cargo xtask train-release-model --study {name}` trains the network {name}")
    })
}

fn find(name: &str) -> Result<&'static Network> {
    NETWORKS.iter().find(|n| n.name == name).with_context(|| {
        let known: Vec<&str> = NETWORKS.iter().map(|n| n.name).collect();
        format!("no network is named {name}; there are {}", known.join(", "))
    })
}

/// How a network is trained.
///
/// # Errors
/// A name that none has.
pub fn settings(name: &str) -> Result<ReleaseArgs> {
    let mut settings = ReleaseArgs::of_line(find(name)?.arguments)?;
    settings.out = Some(file(name));
    settings.logs = Path::new(FOLDER).join("training");
    Ok(settings)
}

/// Trains the networks that `--study` names; those whose file is there are left alone.
///
/// # Errors
/// An unknown name, missing data, a training that fails.
pub fn train(args: &ReleaseArgs) -> Result<()> {
    let names = &args.study;
    let all = names.iter().any(|n| n == "all");
    if all && names.len() > 1 {
        bail!("--study takes `all` or names");
    }
    let names: Vec<&str> = match all {
        true => NETWORKS.iter().map(|n| n.name).collect(),
        false => names.iter().map(String::as_str).collect(),
    };
    for name in names {
        let settings = ReleaseArgs {
            data: args.data.clone(),
            backend: args.backend,
            threads: args.threads,
            ..settings(name)?
        };
        if file(name).exists() {
            println!("{} is trained already", file(name).display());
            continue;
        }
        println!("{name}: train-release-model {}", find(name)?.arguments);
        run(&settings)?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn names_are_different_and_arguments_parse() {
        let names: BTreeSet<&str> = NETWORKS.iter().map(|n| n.name).collect();
        assert_eq!(names.len(), NETWORKS.len());
        for network in &NETWORKS {
            let settings = settings(network.name).unwrap();
            assert_eq!(settings.out(), file(network.name));
        }
        assert_eq!(settings("kitti-length64").unwrap().window, 64);
        assert!(settings("kitti-length65").is_err());
    }

    #[test]
    fn the_compared_lengths_see_the_same_number_of_poses_a_step() {
        for name in [
            "kitti-1500",
            "kitti-length64",
            "kitti-length256",
            "kitti-length512",
        ] {
            let settings = settings(name).unwrap();
            assert_eq!(settings.window * settings.batch, 128 * 64, "{name}");
        }
    }
}
