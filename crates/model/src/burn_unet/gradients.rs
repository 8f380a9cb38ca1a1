use burn::module::{Module, ModuleVisitor, Param};
use burn::tensor::{Gradients, Tensor};

use crate::{ModelError, ParameterLayout};

/// All gradients of a network, flat, in layout order, still on the device.
pub(super) fn collect(
    network: &impl Module,
    gradients: Gradients,
    layout: &ParameterLayout,
) -> Result<Tensor<1>, ModelError> {
    let mut collector = Collector {
        gradients,
        path: Vec::new(),
        found: Vec::new(),
        missing: None,
    };
    network.visit(&mut collector);
    if let Some(name) = collector.missing {
        return Err(ModelError::MissingGradient(name));
    }
    let mut flat = Vec::with_capacity(layout.entries().len());
    let mut found = collector.found.into_iter();
    for spec in layout.entries() {
        // Modules are visited in the order of their fields, which is the layout's.
        match found.next() {
            Some((name, gradient)) if name == spec.name => flat.push(gradient),
            _ => return Err(ModelError::MissingGradient(spec.name.clone())),
        }
    }
    Ok(Tensor::cat(flat, 0))
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
