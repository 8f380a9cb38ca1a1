//! The values of a joint network, and its place in a file.

use super::JointConfig;
use crate::parameters::draw;
use crate::tensors::{NamedTensor, TensorFile};
use crate::{ModelError, ParameterLayout, check_values};

/// The values of a joint network.
#[derive(Clone, Debug, PartialEq)]
pub struct JointParameters {
    /// The network they belong to.
    pub config: JointConfig,
    /// All values, flat, in the order of [`JointConfig::layout`].
    pub values: Vec<f32>,
}

impl JointParameters {
    /// Takes values for a network.
    ///
    /// # Errors
    /// A configuration that is not valid, the wrong number of values, or one that is not finite.
    pub fn new(config: JointConfig, values: Vec<f32>) -> Result<Self, ModelError> {
        config.validate()?;
        check_values(&config.layout(), &values)?;
        Ok(Self { config, values })
    }

    /// Draws starting values; the same seed gives the same ones.
    ///
    /// # Errors
    /// A configuration that is not valid.
    pub fn init(config: &JointConfig, seed: u64) -> Result<Self, ModelError> {
        config.validate()?;
        Ok(Self {
            config: config.clone(),
            values: draw(&config.layout(), seed),
        })
    }

    /// Names, shapes and offsets of the values.
    pub fn layout(&self) -> ParameterLayout {
        self.config.layout()
    }

    /// The tensors, each named `prefix` and its name in `layout`, which is [`Self::layout`].
    pub fn tensors<'a>(
        &'a self,
        prefix: &'a str,
        layout: &'a ParameterLayout,
    ) -> impl Iterator<Item = NamedTensor<'a>> {
        let named = move |spec: &'a crate::ParameterSpec| NamedTensor {
            name: format!("{prefix}{}", spec.name),
            shape: &spec.shape,
            values: &self.values[spec.range()],
        };
        layout.entries().iter().map(named)
    }

    /// Reads the tensors of [`Self::tensors`].
    ///
    /// # Errors
    /// A configuration that is not valid; a tensor that is missing, of another shape or type, or not finite.
    pub fn read(
        config: JointConfig,
        prefix: &str,
        file: &TensorFile<'_>,
    ) -> Result<Self, ModelError> {
        config.validate()?;
        let values = file.flat(prefix, &config.layout())?;
        Self::new(config, values)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Precision, write_tensors};
    use std::collections::BTreeMap;

    #[test]
    fn a_file_that_promises_more_than_it_holds_is_refused_before_anything_is_allocated() {
        let small = JointConfig::new(4, &[1, 2]);
        let parameters = JointParameters::init(&small, 3).unwrap();
        let layout = parameters.layout();
        let tensors: Vec<_> = parameters.tensors("", &layout).collect();
        let bytes = write_tensors(&tensors, Precision::F32, &BTreeMap::new()).unwrap();
        let file = TensorFile::new(&bytes).unwrap();
        // Twelve gigabytes.
        let large = JointConfig {
            embedding: 4096,
            ..JointConfig::new(4096, &[1; 64])
        };
        let refused = JointParameters::read(large, "", &file).unwrap_err();
        assert!(
            matches!(refused, ModelError::TensorShape { .. }),
            "{refused}"
        );
    }

    #[test]
    fn a_file_gives_back_what_was_written() {
        let config = JointConfig::new(4, &[1, 2]);
        let parameters = JointParameters::init(&config, 3).unwrap();
        let layout = parameters.layout();
        let tensors: Vec<_> = parameters.tensors("joint.", &layout).collect();
        let bytes = write_tensors(&tensors, Precision::F32, &BTreeMap::new()).unwrap();
        let file = TensorFile::new(&bytes).unwrap();
        let read = JointParameters::read(config.clone(), "joint.", &file).unwrap();
        assert_eq!(read, parameters);
        assert!(JointParameters::read(config, "other.", &file).is_err());
        let wider = JointConfig::new(5, &[1, 2]);
        assert!(JointParameters::read(wider, "joint.", &file).is_err());
    }
}
