/// What a training run reports after each step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Progress {
    /// Which network is trained: `glow`, `background` or `jem`.
    pub stage: &'static str,
    /// Steps done in this stage, from 1.
    pub step: usize,
    /// Steps of this stage.
    pub steps: usize,
    /// Loss of this step: nats per dimension for Glow, cross-entropy plus energy gap for JEM.
    pub loss: f64,
}
