use burn::module::{Module, ModuleVisitor, Param};
use burn::tensor::{Gradients, Tensor};

use super::Flat;
use crate::{ModelError, ParameterLayout};

/// The gradient of a loss with respect to every parameter of a network that it was computed with, still on the device.
///
/// # Errors
/// A parameter that the loss does not depend on.
pub fn gradient(
    network: &impl Module,
    loss: Tensor<1>,
    layout: &ParameterLayout,
) -> Result<Flat, ModelError> {
    let mut collector = Collector {
        gradients: loss.backward(),
        path: Vec::new(),
        found: Vec::new(),
        missing: None,
    };
    network.visit(&mut collector);
    if let Some(name) = collector.missing {
        return Err(ModelError::MissingGradient(name));
    }
    let mut parts = Vec::with_capacity(layout.entries().len());
    let mut found = collector.found.into_iter();
    for spec in layout.entries() {
        // Modules are visited in the order of their fields, which is the layout's.
        match found.next() {
            Some((name, gradient)) if name == spec.name => parts.push(gradient),
            _ => return Err(ModelError::MissingGradient(spec.name.clone())),
        }
    }
    Ok(Flat::join(layout, parts))
}

struct Collector {
    gradients: Gradients,
    path: Vec<String>,
    found: Vec<(String, Tensor<1>)>,
    missing: Option<String>,
}

impl ModuleVisitor for Collector {
    fn enter_module(&mut self, name: &str, _container: &str) {
        self.path.push(name.to_owned());
    }

    fn exit_module(&mut self, _name: &str, _container: &str) {
        self.path.pop();
    }

    fn visit_float<const D: usize>(&mut self, param: &Param<Tensor<D>>) {
        let name = self.path.join(".");
        let value = param.val();
        let size = value.shape().num_elements();
        match value.grad_remove(&mut self.gradients) {
            Some(gradient) => self.found.push((name, gradient.reshape([size]))),
            None => self.missing = Some(name),
        }
    }
}
