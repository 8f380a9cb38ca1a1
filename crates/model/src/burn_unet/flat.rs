use std::ops::Range;

use burn::module::Module;
use burn::tensor::{Device, Tensor, TensorData};

use super::model::download;
use crate::{ModelError, NetworkConfig, ParameterLayout, ParameterSpec, Parameters};

/// Numbers of a piece, at most, unless one parameter alone has more: 64 MiB. The smallest storage buffer that WebGPU
/// promises has 128.
const PIECE: usize = 1 << 24;

/// A flat vector of a network (parameters, gradient, ...) on a device, in layout order, cut between parameters.
#[derive(Clone, Debug)]
pub struct Flat {
    ranges: Vec<Range<usize>>,
    pieces: Vec<Tensor<1>>,
}

impl Flat {
    /// Puts values on a plain device, without autodiff.
    ///
    /// # Errors
    /// [`ModelError::ParameterCount`].
    pub fn upload(
        layout: &ParameterLayout,
        values: &[f32],
        device: &Device,
    ) -> Result<Self, ModelError> {
        crate::check_count(layout, "the parameter vector", values)?;
        let ranges = cut(layout, PIECE);
        let piece = |range: &Range<usize>| {
            let data = TensorData::new(values[range.clone()].to_vec(), [range.len()]);
            Tensor::from_data(data, device)
        };
        Ok(Self {
            pieces: ranges.iter().map(piece).collect(),
            ranges,
        })
    }

    /// Copies all values to the host.
    ///
    /// # Errors
    /// A failing backend.
    pub fn download(&self) -> Result<Vec<f32>, ModelError> {
        let mut values = Vec::with_capacity(self.ranges.last().map_or(0, |range| range.end));
        for piece in &self.pieces {
            values.extend(download(piece.clone())?);
        }
        Ok(values)
    }

    /// Zeros of the same shape.
    #[must_use]
    pub fn zeros_like(&self) -> Self {
        Self {
            ranges: self.ranges.clone(),
            pieces: self.pieces.iter().map(Tensor::zeros_like).collect(),
        }
    }

    /// The pieces in order; those of one layout are cut alike.
    pub fn pieces(&self) -> &[Tensor<1>] {
        &self.pieces
    }

    /// As [`Self::pieces`], to be replaced by others of their sizes.
    pub fn pieces_mut(&mut self) -> &mut [Tensor<1>] {
        &mut self.pieces
    }

    /// The values of one parameter.
    pub(super) fn parameter(&self, spec: &ParameterSpec) -> Tensor<1> {
        let at = self
            .ranges
            .partition_point(|range| range.end <= spec.offset);
        let (start, size) = (spec.offset - self.ranges[at].start, spec.size());
        self.pieces[at].clone().narrow(0, start, size)
    }

    /// Joins what belongs to each parameter, in layout order.
    pub(super) fn join(layout: &ParameterLayout, parts: Vec<Tensor<1>>) -> Self {
        let ranges = cut(layout, PIECE);
        let mut parts = layout.entries().iter().zip(parts).peekable();
        let piece = |range: &Range<usize>| {
            let own =
                std::iter::from_fn(|| parts.next_if(|(spec, _)| range.contains(&spec.offset)));
            Tensor::cat(own.map(|(_, part)| part).collect(), 0)
        };
        Self {
            pieces: ranges.iter().map(piece).collect(),
            ranges,
        }
    }
}

/// Ranges of at most `most` numbers, or one parameter.
fn cut(layout: &ParameterLayout, most: usize) -> Vec<Range<usize>> {
    let mut ranges: Vec<Range<usize>> = Vec::new();
    for spec in layout.entries() {
        let own = spec.range();
        match ranges.last_mut() {
            Some(range) if own.end - range.start <= most => range.end = own.end,
            _ => ranges.push(own),
        }
    }
    ranges
}

/// A network whose parameters are those of a flat vector on a device.
pub trait FlatNetwork: Module {
    /// Its shape.
    type Config: NetworkConfig;

    /// Builds it where `values` are (without autodiff; [`Module::train`] is for gradients).
    ///
    /// # Errors
    /// A configuration that is not valid.
    fn from_flat(
        config: &Self::Config,
        layout: &ParameterLayout,
        values: &Flat,
    ) -> Result<Self, ModelError>;

    /// Builds it with these parameters on a device.
    ///
    /// # Errors
    /// A configuration that is not valid, or values that do not fit it.
    fn new(parameters: &Parameters<Self::Config>, device: &Device) -> Result<Self, ModelError> {
        let Parameters { config, values } = parameters;
        config.validate()?;
        let layout = config.layout();
        crate::check_values(&layout, values)?;
        Self::from_flat(config, &layout, &Flat::upload(&layout, values, device)?)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::UNetConfig;

    #[test]
    fn pieces_end_between_parameters() {
        let layout = UNetConfig::new(3, 3, 16, &[1, 2]).layout();
        for most in [1, 3000, 10_000, usize::MAX] {
            let ranges = cut(&layout, most);
            assert_eq!(ranges[0].start, 0);
            assert_eq!(ranges.last().unwrap().end, layout.len());
            assert!(ranges.windows(2).all(|pair| pair[0].end == pair[1].start));
            let starts: Vec<usize> = layout.entries().iter().map(|s| s.offset).collect();
            for range in ranges {
                assert!(starts.contains(&range.start));
                let own = starts.iter().filter(|start| range.contains(start)).count();
                assert!(range.len() <= most || own == 1);
            }
        }
    }
}
