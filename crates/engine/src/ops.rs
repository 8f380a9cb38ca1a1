//! The operations of the network, and the tensors between them.

/// An activation tensor: per sample `length >> shift` rows of `channels`, with `halo` zero
/// rows before and after.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Tensor {
    pub(crate) shift: usize,
    pub(crate) channels: usize,
    pub(crate) halo: usize,
}

impl Tensor {
    /// Rows per sample, without the halo.
    pub(crate) fn rows(&self, length: usize) -> usize {
        length >> self.shift
    }

    /// Numbers per sample, with the halo.
    pub(crate) fn size(&self, length: usize) -> usize {
        (self.rows(length) + 2 * self.halo) * self.channels
    }
}

/// Offsets of a normalisation's gain and offset in the flat parameters.
#[derive(Clone, Copy, Debug)]
pub(crate) struct NormAt {
    pub(crate) gain: usize,
    pub(crate) offset: usize,
}

/// Two convolutions with normalisation, modulated by the step, around a residual.
#[derive(Clone, Debug)]
pub(crate) struct Block {
    /// Number of the block in forward order.
    pub(crate) index: usize,
    /// One tensor, or two that are concatenated.
    pub(crate) inputs: Vec<usize>,
    pub(crate) output: usize,
    pub(crate) conv1: usize,
    pub(crate) norm1: NormAt,
    pub(crate) conv2: usize,
    pub(crate) norm2: NormAt,
    pub(crate) residual: Option<usize>,
    /// First column of scale and shift in the time table.
    pub(crate) time_column: usize,
}

/// Attention over the length, with its residual.
#[derive(Clone, Debug)]
pub(crate) struct Attention {
    /// Number of the attention in forward order.
    pub(crate) index: usize,
    pub(crate) input: usize,
    pub(crate) output: usize,
    /// One map per head, from normalised channels to the head's query, key and value.
    pub(crate) heads: Vec<usize>,
    pub(crate) out: usize,
}

/// One step of the forward pass.
#[derive(Clone, Debug)]
pub(crate) enum Op {
    /// A convolution on its own.
    Map {
        map: usize,
        input: usize,
        output: usize,
    },
    /// A residual block.
    Block(Block),
    /// Attention.
    Attention(Attention),
}

impl Op {
    /// Tensors read.
    pub(crate) fn inputs(&self) -> &[usize] {
        match self {
            Self::Map { input, .. } => std::slice::from_ref(input),
            Self::Block(block) => &block.inputs,
            Self::Attention(attention) => std::slice::from_ref(&attention.input),
        }
    }

    /// The maps in the order in which the backward pass adds to their gradients.
    pub(crate) fn maps_backward(&self) -> Vec<usize> {
        match self {
            Self::Map { map, .. } => vec![*map],
            Self::Block(block) => [block.conv2, block.conv1]
                .into_iter()
                .chain(block.residual)
                .collect(),
            Self::Attention(attention) => [attention.out]
                .into_iter()
                .chain(attention.heads.iter().copied())
                .collect(),
        }
    }

    /// The tensor written.
    pub(crate) fn output(&self) -> usize {
        match self {
            Self::Map { output, .. } => *output,
            Self::Block(block) => block.output,
            Self::Attention(attention) => attention.output,
        }
    }
}
