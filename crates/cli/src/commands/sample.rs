//! `dose3 sample`

use super::{computing, model};
use crate::args::Sample;
use crate::output_file::{Kind, OutputFile};
use crate::terminal::{count, say};
use anyhow::Result;
use dose3::generate;
use dose3_datasets::write;

/// A log is never known to be one of ours.
const SEQUENCE: Kind = Kind {
    name: "empty file",
    begins: |_| false,
};

pub fn run(args: &Sample) -> Result<()> {
    let seeds = (0..args.count).map(|i| args.seed.wrapping_add(i as u64));
    let files: Vec<(u64, OutputFile)> = seeds
        .map(|seed| {
            let path = args.out.join(format!("sample_{seed}.txt"));
            Ok((seed, OutputFile::new(&path, SEQUENCE, args.force)?))
        })
        .collect::<Result<_>>()?;
    let model = model(&args.model)?;
    let mut models = computing(&args.computing).load(&model.parameters)?;
    for (seed, file) in files {
        let trajectory = generate::sequence(&model, &mut models, seed)?;
        let mut bytes = Vec::new();
        write::kitti(&mut bytes, &trajectory)?;
        file.save(&bytes)?;
    }
    say(&format!(
        "wrote {} to {}",
        count(args.count, "sequence"),
        args.out.display()
    ));
    Ok(())
}
