use burn::module::Param;
use burn::tensor::Tensor;

use super::Flat;
use crate::{ModelError, ParameterLayout};

/// Hands out parameters by name, from a flat vector on a device.
#[derive(Clone)]
pub(super) struct Source<'a> {
    layout: &'a ParameterLayout,
    values: &'a Flat,
    prefix: String,
}

impl<'a> Source<'a> {
    /// `values` are in the order of `layout`.
    pub(super) fn new(layout: &'a ParameterLayout, values: &'a Flat) -> Self {
        Self {
            layout,
            values,
            prefix: String::new(),
        }
    }

    /// The parameters whose names start with `name.`.
    pub(super) fn enter(&self, name: impl std::fmt::Display) -> Self {
        Self {
            prefix: format!("{}{name}.", self.prefix),
            ..self.clone()
        }
    }

    /// One parameter, with the shape of the layout.
    pub(super) fn tensor<const D: usize>(
        &self,
        name: &str,
    ) -> Result<Param<Tensor<D>>, ModelError> {
        let name = format!("{}{name}", self.prefix);
        let Some(spec) = self.layout.find(&name) else {
            return Err(ModelError::MissingTensor(name));
        };
        let Ok(shape) = <[usize; D]>::try_from(spec.shape.as_slice()) else {
            let (expected, found) = (vec![0; D], spec.shape.clone());
            return Err(ModelError::TensorShape {
                name,
                expected,
                found,
            });
        };
        Ok(Param::from_tensor(
            self.values.parameter(spec).reshape(shape),
        ))
    }

    /// Whether the layout has this parameter.
    pub(super) fn has(&self, name: &str) -> bool {
        self.layout
            .find(&format!("{}{name}", self.prefix))
            .is_some()
    }
}
