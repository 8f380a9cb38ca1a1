use burn::module::Module;
use burn::tensor::Tensor;

use super::attention::Attention;
use super::block::Block;
use super::conv::Conv;
use super::resample::{self, double_length};
use super::source::Source;
use super::time::{TimeMlp, features};
use super::{Flat, FlatNetwork};
use crate::{ModelError, ParameterLayout, UNetConfig};

/// The 1-D UNet noise estimator.
#[derive(Module, Debug)]
pub struct UNet {
    time_mlp: TimeMlp,
    init_conv: Conv,
    downs: Vec<Level>,
    mid: Middle,
    ups: Vec<Level>,
    final_block: Block,
    final_conv: Conv,
    width: usize,
}

/// Two blocks and attention at one resolution, then the way to the next.
#[derive(Module, Debug)]
struct Level {
    block1: Block,
    block2: Block,
    attention: Attention,
    resample: Conv,
}

#[derive(Module, Debug)]
struct Middle {
    block1: Block,
    attention: Attention,
    block2: Block,
}

impl FlatNetwork for UNet {
    type Config = UNetConfig;

    fn from_flat(
        config: &UNetConfig,
        layout: &ParameterLayout,
        values: &Flat,
    ) -> Result<Self, ModelError> {
        config.validate()?;
        let source = Source::new(layout, values);

        let last = config.levels() - 1;
        let down = |i| {
            Level::new(&source.enter("downs").enter(i), config, |s| {
                resample::down(s, i == last)
            })
        };
        let up = |j| Level::new(&source.enter("ups").enter(j), config, resample::up);
        let mid = source.enter("mid");
        Ok(Self {
            time_mlp: TimeMlp::new(&source.enter("time_mlp"))?,
            init_conv: Conv::new(&source.enter("init_conv"), 1, 3)?,
            downs: (0..=last).map(down).collect::<Result<_, _>>()?,
            mid: Middle {
                block1: Block::new(&mid.enter("block1"), config.groups)?,
                attention: Attention::new(&mid.enter("attention"), config)?,
                block2: Block::new(&mid.enter("block2"), config.groups)?,
            },
            ups: (0..=last).map(up).collect::<Result<_, _>>()?,
            final_block: Block::new(&source.enter("final_block"), config.groups)?,
            final_conv: Conv::new(&source.enter("final_conv"), 1, 0)?,
            width: config.width,
        })
    }
}

impl UNet {
    /// Estimates the noise of `x`, `[batch, length, in]`, at the diffusion step of each
    /// window: `[batch, length, out]`.
    ///
    /// # Panics
    /// On shapes that do not fit; [`Input::check`](crate::Input::check) tells beforehand.
    pub fn forward(&self, x: Tensor<3>, steps: &[f32]) -> Tensor<3> {
        let time = features(steps, self.width, &x.device()); // [batch, width]
        let time = self.time_mlp.forward(time); // [batch, 4 * width]
        let first = self.init_conv.forward(x); // [batch, length, width]

        let mut x = first.clone();
        let mut skips = Vec::with_capacity(2 * self.downs.len());
        for level in &self.downs {
            x = level.block1.forward(x, time.clone());
            skips.push(x.clone());
            x = level
                .attention
                .forward(level.block2.forward(x, time.clone()));
            skips.push(x.clone());
            x = level.resample.forward(x); // [batch, length / 2, next], the last keeps the length
        }

        x = self.mid.block1.forward(x, time.clone());
        x = self.mid.attention.forward(x);
        x = self.mid.block2.forward(x, time.clone());

        let mut skips = skips.into_iter().rev();
        let mut join = |x| Tensor::cat(std::iter::once(x).chain(skips.next()).collect(), 2);
        let last = self.ups.len() - 1;
        for (j, level) in self.ups.iter().enumerate() {
            x = level.block1.forward(join(x), time.clone());
            x = level.block2.forward(join(x), time.clone());
            x = level.attention.forward(x);
            let wide = if j < last { double_length(x) } else { x };
            x = level.resample.forward(wide); // [batch, 2 * length, next], the last keeps the length
        }

        x = self
            .final_block
            .forward(Tensor::cat(vec![x, first], 2), time);
        self.final_conv.forward(x) // [batch, length, out]
    }
}

impl Level {
    fn new<'a>(
        source: &Source<'a>,
        config: &UNetConfig,
        resample: impl Fn(&Source<'a>) -> Result<Conv, ModelError>,
    ) -> Result<Self, ModelError> {
        Ok(Self {
            block1: Block::new(&source.enter("block1"), config.groups)?,
            block2: Block::new(&source.enter("block2"), config.groups)?,
            attention: Attention::new(&source.enter("attention"), config)?,
            resample: resample(&source.enter("resample"))?,
        })
    }
}
