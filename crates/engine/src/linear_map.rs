//! Every convolution and linear layer of the network as matrix products on strided rows.

/// One matrix product of a map: which input rows form a left row, and where its result goes.
#[derive(Clone, Debug)]
pub(crate) struct Application {
    /// For every block of input rows in a left row: the original taps whose weights add up
    /// to its weight, as a bit mask.
    pub(crate) taps: Vec<u32>,
    /// Input row of output row 0's first block; negative rows are halo.
    pub(crate) first: isize,
    /// Input rows between two products.
    pub(crate) input_step: usize,
    /// Output row of the first product.
    pub(crate) output_first: usize,
    /// Output rows between two products.
    pub(crate) output_step: usize,
}

impl Application {
    fn new(taps: &[u32], first: isize, input_step: usize, output: (usize, usize)) -> Self {
        let (output_first, output_step) = output;
        Self {
            taps: taps.to_vec(),
            first,
            input_step,
            output_first,
            output_step,
        }
    }
}

/// What kind of convolution a map is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Form {
    /// Stride 1, an odd number of taps, padded to keep the length; one tap is a linear layer.
    Same(usize),
    /// Four taps, stride 2, padding 1: half the length.
    Down,
    /// Nearest neighbour to twice the length, then three taps, padding 1.
    Up,
}

impl Form {
    /// Taps of the stored weight.
    pub(crate) fn taps(self) -> usize {
        match self {
            Self::Same(taps) => taps,
            Self::Down => 4,
            Self::Up => 3,
        }
    }

    /// Products that compute the output.
    pub(crate) fn forward(self) -> Vec<Application> {
        match self {
            Self::Same(taps) => {
                let masks: Vec<u32> = (0..taps).map(|t| 1 << t).collect();
                vec![Application::new(&masks, -(taps as isize / 2), 1, (0, 1))]
            }
            Self::Down => vec![Application::new(&[1, 2, 4, 8], -1, 2, (0, 1))],
            // The doubled row is never made: an even output row sees input rows (l-1, l, l),
            // an odd one (l, l, l+1), so two taps share a row and their weights add up.
            Self::Up => vec![
                Application::new(&[0b001, 0b110], -1, 1, (0, 2)),
                Application::new(&[0b011, 0b100], 0, 1, (1, 2)),
            ],
        }
    }

    /// Products that compute the gradient at the input from that at the output; their
    /// weights are transposed. Halving and doubling are each other's mirror image.
    pub(crate) fn backward(self) -> Vec<Application> {
        match self {
            Self::Same(taps) => {
                let masks: Vec<u32> = (0..taps).rev().map(|t| 1 << t).collect();
                vec![Application::new(&masks, -(taps as isize / 2), 1, (0, 1))]
            }
            Self::Down => vec![
                Application::new(&[8, 2], -1, 1, (0, 2)),
                Application::new(&[4, 1], 0, 1, (1, 2)),
            ],
            Self::Up => vec![Application::new(
                &[0b100, 0b110, 0b011, 0b001],
                -1,
                2,
                (0, 1),
            )],
        }
    }
}

/// A packed matrix `[k, n]` and how it is applied.
#[derive(Clone, Debug)]
pub(crate) struct Matrix {
    pub(crate) application: Application,
    /// Offset in the packed weights of its direction.
    pub(crate) offset: usize,
    pub(crate) k: usize,
    pub(crate) n: usize,
}

/// The input channels that come from one tensor: a concatenation is never made, every part
/// is multiplied with its own weights.
#[derive(Clone, Debug)]
pub(crate) struct Part {
    /// First input channel.
    pub(crate) first: usize,
    pub(crate) channels: usize,
    pub(crate) forward: Vec<Matrix>,
    pub(crate) backward: Vec<Matrix>,
    /// Offset of each forward matrix's gradient (`[k, n]` row-major) in the map's gradient.
    pub(crate) gradient: Vec<usize>,
}

/// A convolution or linear layer.
#[derive(Clone, Debug)]
pub(crate) struct LinearMap {
    /// Offset of the weight `[outputs in the file, inputs, taps]` in the flat parameters.
    pub(crate) weight: usize,
    pub(crate) form: Form,
    pub(crate) inputs: usize,
    pub(crate) outputs: usize,
    /// Rows of the weight that are this map's outputs: `(first, count)`, in order.
    pub(crate) rows: Vec<(usize, usize)>,
    /// Offset of the bias in the flat parameters.
    pub(crate) bias: Option<usize>,
    /// Offset of a gain per input channel that is multiplied into the weight.
    pub(crate) gain: Option<usize>,
    /// Whether the weight is standardised per output channel.
    pub(crate) standardised: bool,
    pub(crate) parts: Vec<Part>,
    /// Size of the gradient of all matrices.
    pub(crate) gradient_len: usize,
    /// Numbers in the stored weight, which may have other maps' rows too.
    pub(crate) weight_len: usize,
}

impl LinearMap {
    /// The rows of the weight in the order of the outputs.
    pub(crate) fn weight_rows(&self) -> impl Iterator<Item = usize> + '_ {
        self.rows
            .iter()
            .flat_map(|&(first, count)| first..first + count)
    }

    /// The bias's values.
    pub(crate) fn bias<'v>(&self, values: &'v [f32]) -> Option<&'v [f32]> {
        self.bias.map(|at| &values[at..at + self.outputs])
    }
}
