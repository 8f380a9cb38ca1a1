use crate::UNetConfig;

/// How a parameter starts; PyTorch's defaults.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Init {
    /// Uniform in `[-bound, bound]`, `bound = 1 / sqrt(fan_in)`: convolutions and linear layers, and their biases.
    Uniform {
        /// The bound.
        bound: f32,
    },
    /// One: gains of normalisations.
    Ones,
    /// Zero: offsets of normalisations.
    Zeros,
}

/// One parameter tensor and its place in the flat vector.
#[derive(Clone, Debug, PartialEq)]
pub struct ParameterSpec {
    /// Dotted path, e.g. `downs.0.block1.conv1.weight`.
    pub name: String,
    /// Row-major shape: convolution `[out, in, kernel]`, linear layer `[out, in]`, bias and norm `[channels]`.
    pub shape: Vec<usize>,
    /// Index of the first value in the flat vector.
    pub offset: usize,
    /// How it starts.
    pub init: Init,
}

impl ParameterSpec {
    /// Number of values.
    pub fn size(&self) -> usize {
        self.shape.iter().product()
    }

    /// The values' range in the flat vector.
    pub fn range(&self) -> std::ops::Range<usize> {
        self.offset..self.offset + self.size()
    }
}

/// All parameters of one network, in the order in which the forward pass first uses them.
///
/// This order is the order of every flat parameter and gradient vector in the project.
#[derive(Clone, Debug, PartialEq)]
pub struct ParameterLayout {
    entries: Vec<ParameterSpec>,
    len: usize,
}

impl ParameterLayout {
    pub(crate) fn new(config: &UNetConfig) -> Self {
        Self::of(|visit| walk(config, visit))
    }

    /// The parameters in the order in which `walk` visits them.
    pub(crate) fn of(walk: impl FnOnce(Visit<'_>)) -> Self {
        let mut layout = Self {
            entries: Vec::new(),
            len: 0,
        };
        walk(&mut |name, shape, init| {
            let spec = ParameterSpec {
                name,
                shape,
                offset: layout.len,
                init,
            };
            layout.len += spec.size();
            layout.entries.push(spec);
        });
        layout
    }

    /// The parameters in order.
    pub fn entries(&self) -> &[ParameterSpec] {
        &self.entries
    }

    /// Number of values of all parameters together: the length of a flat vector.
    #[allow(clippy::len_without_is_empty)] // a network without parameters does not exist
    pub fn len(&self) -> usize {
        self.len
    }

    /// The parameter with this name.
    pub fn find(&self, name: &str) -> Option<&ParameterSpec> {
        self.entries.iter().find(|spec| spec.name == name)
    }

    /// The values of one parameter in a flat vector of this layout.
    pub fn slice<'v>(&self, name: &str, values: &'v [f32]) -> Option<&'v [f32]> {
        values.get(self.find(name)?.range())
    }
}

/// Number of parameters without overflow, for configurations that are not checked yet.
pub(crate) fn count(config: &UNetConfig) -> u128 {
    let mut total = 0u128;
    walk(config, &mut |_, shape, _| {
        total = total.saturating_add(shape.iter().map(|&n| n as u128).product());
    });
    total
}

/// What is called with every parameter: its name, shape, and how it starts.
pub(crate) type Visit<'v> = &'v mut dyn FnMut(String, Vec<usize>, Init);

/// Visits every parameter in the order of the forward pass.
fn walk(config: &UNetConfig, visit: Visit<'_>) {
    let (width, time) = (config.width, config.time_width());
    let dims = config.dims();
    linear("time_mlp.linear1", width, time, visit);
    linear("time_mlp.linear2", time, time, visit);
    conv("init_conv", config.in_channels, width, 7, visit);

    let last = config.levels() - 1;
    for (i, pair) in dims.windows(2).enumerate() {
        let (from, to) = (pair[0], pair[1]);
        block(&format!("downs.{i}.block1"), from, from, time, visit);
        block(&format!("downs.{i}.block2"), from, from, time, visit);
        attention(&format!("downs.{i}.attention"), from, config, visit);
        let kernel = if i == last { 3 } else { 4 };
        conv(&format!("downs.{i}.resample"), from, to, kernel, visit);
    }

    let deepest = dims[config.levels()];
    block("mid.block1", deepest, deepest, time, visit);
    attention("mid.attention", deepest, config, visit);
    block("mid.block2", deepest, deepest, time, visit);

    for (j, pair) in dims.windows(2).rev().enumerate() {
        let (to, from) = (pair[0], pair[1]);
        block(&format!("ups.{j}.block1"), from + to, from, time, visit);
        block(&format!("ups.{j}.block2"), from + to, from, time, visit);
        attention(&format!("ups.{j}.attention"), from, config, visit);
        conv(&format!("ups.{j}.resample"), from, to, 3, visit);
    }

    block("final_block", 2 * width, width, time, visit);
    conv("final_conv", width, config.out_channels, 1, visit);
}

fn block(name: &str, from: usize, to: usize, time: usize, visit: Visit<'_>) {
    linear(&format!("{name}.time"), time, 2 * to, visit);
    conv(&format!("{name}.conv1"), from, to, 3, visit);
    norm(&format!("{name}.norm1"), to, visit);
    conv(&format!("{name}.conv2"), to, to, 3, visit);
    norm(&format!("{name}.norm2"), to, visit);
    if from != to {
        conv(&format!("{name}.residual"), from, to, 1, visit);
    }
}

fn attention(name: &str, channels: usize, config: &UNetConfig, visit: Visit<'_>) {
    let inner = config.attention_width();
    visit(format!("{name}.norm.weight"), vec![channels], Init::Ones);
    visit(
        format!("{name}.qkv.weight"),
        vec![3 * inner, channels, 1],
        uniform(channels),
    );
    conv(&format!("{name}.out"), inner, channels, 1, visit);
}

fn conv(name: &str, from: usize, to: usize, kernel: usize, visit: Visit<'_>) {
    let init = uniform(from * kernel);
    visit(format!("{name}.weight"), vec![to, from, kernel], init);
    visit(format!("{name}.bias"), vec![to], init);
}

fn linear(name: &str, from: usize, to: usize, visit: Visit<'_>) {
    visit(format!("{name}.weight"), vec![to, from], uniform(from));
    visit(format!("{name}.bias"), vec![to], uniform(from));
}

fn norm(name: &str, channels: usize, visit: Visit<'_>) {
    visit(format!("{name}.weight"), vec![channels], Init::Ones);
    visit(format!("{name}.bias"), vec![channels], Init::Zeros);
}

fn uniform(fan_in: usize) -> Init {
    Init::Uniform {
        bound: (1.0 / (fan_in as f64).sqrt()) as f32,
    }
}
