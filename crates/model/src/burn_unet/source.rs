use burn::module::Param;
use burn::tensor::{Device, Tensor, TensorData};

use crate::{ModelError, ParameterLayout};

/// Hands out parameters by name, from one flat vector that is uploaded once.
#[derive(Clone)]
pub(super) struct Source<'a> {
    layout: &'a ParameterLayout,
    values: Tensor<1>,
    prefix: String,
}

impl<'a> Source<'a> {
    /// `values` is flat, in the order of `layout`; `device` is a plain one, without autodiff.
    pub(super) fn new(layout: &'a ParameterLayout, values: &[f32], device: &Device) -> Self {
        let data = TensorData::new(values.to_vec(), [values.len()]);
        Self {
            layout,
            values: Tensor::from_data(data, device),
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
        let tensor = self.values.clone().slice([spec.range()]).reshape(shape);
        Ok(Param::from_tensor(tensor))
    }

    /// Whether the layout has this parameter.
    pub(super) fn has(&self, name: &str) -> bool {
        self.layout
            .find(&format!("{}{name}", self.prefix))
            .is_some()
    }
}
