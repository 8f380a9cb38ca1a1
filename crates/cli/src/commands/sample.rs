//! `dose3 sample`

use super::{check_folder, computing, count, model, say};
use crate::args::Sample;
use anyhow::{Context, Result};
use dose3::{atomic, generate};
use dose3_datasets::write;

pub fn run(args: &Sample) -> Result<()> {
    check_folder(&args.out)?;
    let model = model(&args.model)?;
    let mut models = computing(&args.computing).load(&model.parameters)?;
    for i in 0..args.count {
        let seed = args.seed.wrapping_add(i as u64);
        let trajectory = generate::sequence(&model, &mut models, seed)?;
        let mut bytes = Vec::new();
        write::kitti(&mut bytes, &trajectory)?;
        let path = args.out.join(format!("sample_{seed}.txt"));
        atomic::write(&path, &bytes).context("cannot write a generated sequence")?;
    }
    say(&format!(
        "wrote {} to {}",
        count(args.count, "sequence"),
        args.out.display()
    ));
    Ok(())
}
