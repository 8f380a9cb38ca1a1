//! Forward, loss and backward of a batch, chunk by chunk, on several threads.
//!
//! All chunks add to the same gradients, each in its turn, yet no thread ever waits for another:
//! the loss may use rayon itself, and a thread that waits there for its own tasks is handed
//! whatever else the pool has. If that were another chunk, and waited for its turn, it could
//! wait for the very chunk whose loss lies suspended below it on the stack. So a chunk that
//! comes to a gradient before its turn is laid aside ([`Turn`]) and its thread is free; the
//! chunk before it makes a new task of it. The first of the unfinished chunks never has to be
//! laid aside, so there always is one that gets on.

use dose3_model::{Input, LossGradient};
use rayon::Scope;

use crate::backward::Backward;
use crate::forward::{Chunk, Network};
use crate::gradient::SharedGradient;
use crate::turn::Turn;
use crate::workers::Pieces;
use crate::workspace::Workspace;

/// What the chunks of a batch share.
pub(crate) struct Training<'a> {
    network: Network<'a>,
    input: Input<'a>,
    loss: &'a LossGradient<'a>,
    /// Windows in a chunk.
    size: usize,
    /// Row of the time table, per window.
    steps: &'a [usize],
    /// The gradients at every window's scales and shifts, a piece per chunk.
    time: Pieces<'a, 1>,
    /// Per map.
    gradients: &'a [SharedGradient],
    turns: Vec<Turn<Pass<'a>>>,
}

/// A chunk on its way back, in the memory that it needs.
pub(crate) struct Pass<'a> {
    backward: Backward<'a>,
    workspace: &'a mut Workspace,
    time: &'a mut [f32],
    /// Place in [`Plan::backward`](crate::plan::Plan) and the gradient there that it comes to.
    at: (usize, usize),
}

impl<'a> Training<'a> {
    /// `time_gradient`: `[batch, columns]` zeros.
    pub(crate) fn new(
        network: Network<'a>,
        (input, loss): (Input<'a>, &'a LossGradient<'a>),
        size: usize,
        steps: &'a [usize],
        time_gradient: &'a mut [f32],
        gradients: &'a [SharedGradient],
    ) -> Self {
        let columns = network.plan.time.columns;
        let pieces = [(time_gradient, size * columns)];
        Self {
            network,
            input,
            loss,
            size,
            steps,
            time: Pieces::new(input.batch.div_ceil(size), pieces),
            gradients,
            turns: gradients.iter().map(|_| Turn::new()).collect(),
        }
    }

    /// Works through the batch, with as many chunks under way as there are workspaces.
    pub(crate) fn run(&self, workspaces: &'a mut [Workspace]) {
        match workspaces {
            // Chunk by chunk on this thread: none comes before its turn.
            [only] => self.chunks(None, only),
            many => rayon::scope(|scope| {
                for workspace in many {
                    scope.spawn(move |scope| self.chunks(Some(scope), workspace));
                }
            }),
        }
    }

    /// Takes chunks until there are no more, or one has to be laid aside.
    fn chunks<'s>(&'s self, scope: Option<&Scope<'s>>, mut workspace: &'a mut Workspace)
    where
        'a: 's,
    {
        while let Some((chunk, [time])) = self.time.take() {
            let pass = self.begin(chunk, workspace, time);
            match self.go_on(scope, pass) {
                Some(free) => workspace = free,
                None => return,
            }
        }
    }

    /// Forward and loss of a chunk, and backward to its first gradient.
    fn begin(&self, chunk: usize, ws: &'a mut Workspace, time: &'a mut [f32]) -> Pass<'a> {
        let (network, input) = (self.network, self.input);
        let config = &network.plan.config;
        let first = chunk * self.size;
        let steps = &self.steps[first..input.batch.min(first + self.size)];
        ws.size(network.plan, input.length, self.size);
        let x = &input.x[first * input.length * config.in_channels..];
        network.forward(Chunk { x, steps }, ws);

        let size = steps.len() * input.length * config.out_channels;
        let mut output = std::mem::take(&mut ws.backward.output);
        network.copy_output(steps.len(), ws, &mut output);
        let gradient = &mut ws.backward.output_gradient[..size];
        gradient.fill(0.0);
        (self.loss)(first, &output[..size], gradient);
        ws.backward.output = output;

        let backward = Backward {
            network,
            chunk,
            steps,
        };
        backward.start(ws);
        let mut pass = Pass {
            backward,
            workspace: ws,
            time,
            at: (0, 0),
        };
        pass.stage();
        pass
    }

    /// Backward from one gradient to the next. Answers the workspace at the end; nothing where
    /// the chunk has been laid aside.
    fn go_on<'s>(
        &'s self,
        scope: Option<&Scope<'s>>,
        mut pass: Pass<'a>,
    ) -> Option<&'a mut Workspace>
    where
        'a: 's,
    {
        while let Some(map) = pass.map() {
            let turn = &self.turns[map];
            pass = turn.arrive(pass.backward.chunk, pass)?;
            pass.add(&self.gradients[map]);
            if let (Some(next), Some(scope)) = (turn.end(), scope) {
                scope.spawn(move |scope| {
                    if let Some(free) = self.go_on(Some(scope), next) {
                        self.chunks(Some(scope), free);
                    }
                });
            }
            pass.advance();
        }
        Some(pass.workspace)
    }
}

impl Pass<'_> {
    /// The map whose gradient comes next; none at the end of the network.
    fn map(&self) -> Option<usize> {
        let (_, maps) = self.backward.network.plan.backward.get(self.at.0)?;
        Some(maps[self.at.1])
    }

    fn add(&mut self, gradient: &SharedGradient) {
        let plan = self.backward.network.plan;
        let op = &plan.ops[plan.backward[self.at.0].0];
        let mut gradient = gradient.lock();
        self.backward
            .add(op, self.at.1, self.workspace, &mut gradient);
    }

    /// Computes what lies between this gradient and the next.
    fn advance(&mut self) {
        self.at.1 += 1;
        self.stage();
        let operations = &self.backward.network.plan.backward;
        if self.at.1 == operations[self.at.0].1.len() {
            self.at = (self.at.0 + 1, 0);
            if self.at.0 < operations.len() {
                self.stage();
            }
        }
    }

    fn stage(&mut self) {
        let plan = self.backward.network.plan;
        let op = &plan.ops[plan.backward[self.at.0].0];
        self.backward
            .stage(op, self.at.1, self.workspace, self.time);
    }
}
