use burn::grad_clipping::GradientClippingConfig;
use burn::module::Module;
use burn::optim::{AdamConfig, GradientsParams, ModuleOptimizer};
use burn::tensor::Tensor;

/// Adam (Kingma and Ba 2015) with a linear warm-up, a cosine decay to a tenth, and the gradient of each
/// parameter tensor clipped to unit norm.
pub(crate) struct Optimiser {
    adam: ModuleOptimizer,
    rate: f64,
    warm_up: usize,
    steps: usize,
}

impl Optimiser {
    pub(crate) fn new(rate: f64, steps: usize) -> Self {
        Self {
            adam: AdamConfig::new()
                .with_epsilon(1e-8)
                .with_grad_clipping(Some(GradientClippingConfig::Norm(1.0)))
                .init(),
            rate,
            warm_up: (steps / 20).max(1),
            steps,
        }
    }

    pub(crate) fn step<M: Module>(&mut self, step: usize, network: M, loss: &Tensor<1>) -> M {
        let gradients = GradientsParams::from_grads(loss.backward(), &network);
        self.adam.step(self.rate_at(step), network, gradients)
    }

    fn rate_at(&self, step: usize) -> f64 {
        let warm = ((step + 1) as f64 / self.warm_up as f64).min(1.0);
        let done = step as f64 / self.steps as f64;
        let cosine = 0.5 * (1.0 + (std::f64::consts::PI * done).cos());
        self.rate * warm * (0.1 + 0.9 * cosine)
    }
}
