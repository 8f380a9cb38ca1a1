//! The network as a list of operations on numbered tensors.

use dose3_model::{ParameterLayout, UNetConfig};

use crate::linear_map::{Form, LinearMap, Matrix, Part};
use crate::matmul::packed_len;
use crate::ops::{Attention, Block, NormAt, Op, Tensor};
use crate::slots::{Slots, assign};

/// The layers that turn a step into every block's scale and shift.
#[derive(Clone, Debug)]
pub(crate) struct TimePlan {
    pub(crate) linear1: usize,
    pub(crate) linear2: usize,
    /// Map and first column in the time table, per block.
    pub(crate) blocks: Vec<(usize, usize)>,
    /// Columns of the time table: scale and shift of all blocks.
    pub(crate) columns: usize,
}

/// The whole network.
pub(crate) struct Plan {
    pub(crate) config: UNetConfig,
    pub(crate) layout: ParameterLayout,
    pub(crate) tensors: Vec<Tensor>,
    pub(crate) ops: Vec<Op>,
    /// The operations backward, each with the maps whose gradients it adds to, in this order.
    pub(crate) backward: Vec<(usize, Vec<usize>)>,
    pub(crate) maps: Vec<LinearMap>,
    pub(crate) time: TimePlan,
    /// Size of all packed weights, by direction.
    pub(crate) forward_len: usize,
    pub(crate) backward_len: usize,
    /// Buffers of the tensors when only the output is wanted.
    pub(crate) inference: Slots,
    /// Buffers of the tensors' gradients.
    pub(crate) gradients: Slots,
    pub(crate) attentions: usize,
    pub(crate) blocks: usize,
    /// Maps that share a weight, in the order of the weights.
    by_weight: Vec<Vec<usize>>,
}

impl Plan {
    /// For a configuration that is valid.
    pub(crate) fn new(config: &UNetConfig) -> Self {
        Builder::new(config).build()
    }

    /// Maps grouped by their weight, in the order in which these lie in the flat parameters.
    pub(crate) fn maps_by_weight(&self) -> &[Vec<usize>] {
        &self.by_weight
    }

    /// Floating-point operations of all products of a forward pass, per sample: a
    /// multiplication and an addition each.
    pub(crate) fn flops(&self, length: usize) -> u64 {
        let mut sum = 0;
        for op in &self.ops {
            let rows = self.tensors[op.output()].rows(length);
            let mut add = |map: usize| {
                for part in &self.maps[map].parts {
                    for matrix in &part.forward {
                        sum += rows / matrix.application.output_step * matrix.k * matrix.n;
                    }
                }
            };
            match op {
                Op::Map { map, .. } => add(*map),
                Op::Block(block) => {
                    let maps = [block.conv1, block.conv2].into_iter().chain(block.residual);
                    maps.for_each(add);
                }
                Op::Attention(attention) => {
                    attention.heads.iter().for_each(|&head| add(head));
                    add(attention.out);
                    // Scores and the values they weigh.
                    sum += 2 * rows * rows * self.config.attention_width();
                }
            }
        }
        2 * sum as u64
    }

    /// Most channels of any tensor.
    pub(crate) fn widest(&self) -> usize {
        self.tensors
            .iter()
            .map(|tensor| tensor.channels)
            .max()
            .unwrap_or(0)
    }
}

fn group_by_weight(maps: &[LinearMap]) -> Vec<Vec<usize>> {
    let mut groups = std::collections::BTreeMap::<usize, Vec<usize>>::new();
    for (id, map) in maps.iter().enumerate() {
        groups.entry(map.weight).or_default().push(id);
    }
    groups.into_values().collect()
}

struct Builder<'c> {
    config: &'c UNetConfig,
    layout: ParameterLayout,
    tensors: Vec<Tensor>,
    ops: Vec<Op>,
    maps: Vec<LinearMap>,
    time_blocks: Vec<(usize, usize)>,
    time_columns: usize,
    forward_len: usize,
    backward_len: usize,
    attentions: usize,
}

impl<'c> Builder<'c> {
    fn new(config: &'c UNetConfig) -> Self {
        Self {
            config,
            layout: config.layout(),
            tensors: Vec::new(),
            ops: Vec::new(),
            maps: Vec::new(),
            time_blocks: Vec::new(),
            time_columns: 0,
            forward_len: 0,
            backward_len: 0,
            attentions: 0,
        }
    }

    fn build(mut self) -> Plan {
        let config = self.config;
        let (levels, dims) = (config.levels(), config.dims());
        let (width, time) = (config.width, config.time_width());
        let linear1 = self.map("time_mlp.linear1", Form::Same(1), &[width], false);
        let linear2 = self.map("time_mlp.linear2", Form::Same(1), &[time], false);

        let input = self.tensor(0, config.in_channels, 3);
        let first = self.convolution("init_conv", Form::Same(7), input, 0, width);
        let mut x = first;
        let mut skips = Vec::new();
        for (i, pair) in dims.windows(2).enumerate() {
            x = self.block(&format!("downs.{i}.block1"), &[x], pair[0]);
            skips.push(x);
            x = self.block(&format!("downs.{i}.block2"), &[x], pair[0]);
            x = self.attention(&format!("downs.{i}.attention"), x);
            skips.push(x);
            let (form, shift) = if i + 1 == levels {
                (Form::Same(3), i)
            } else {
                (Form::Down, i + 1)
            };
            x = self.convolution(&format!("downs.{i}.resample"), form, x, shift, pair[1]);
        }
        x = self.block("mid.block1", &[x], dims[levels]);
        x = self.attention("mid.attention", x);
        x = self.block("mid.block2", &[x], dims[levels]);
        for (j, pair) in dims.windows(2).rev().enumerate() {
            for block in ["block1", "block2"] {
                // Two pushes per level on the way down, two pops per level on the way up.
                let inputs: Vec<usize> = [x].into_iter().chain(skips.pop()).collect();
                x = self.block(&format!("ups.{j}.{block}"), &inputs, pair[1]);
            }
            x = self.attention(&format!("ups.{j}.attention"), x);
            let shift = levels - 1 - j;
            let (form, shift) = if j + 1 == levels {
                (Form::Same(3), shift)
            } else {
                (Form::Up, shift - 1)
            };
            x = self.convolution(&format!("ups.{j}.resample"), form, x, shift, pair[0]);
        }
        x = self.block("final_block", &[x, first], width);
        self.convolution("final_conv", Form::Same(1), x, 0, config.out_channels);

        let time = TimePlan {
            linear1,
            linear2,
            blocks: self.time_blocks,
            columns: self.time_columns,
        };
        let backward = self.ops.iter().enumerate().rev();
        let backward = backward.map(|(i, op)| (i, op.maps_backward())).collect();
        Plan {
            inference: Slots::new(&assign(&self.ops, self.tensors.len(), false), &self.tensors),
            gradients: Slots::new(&assign(&self.ops, self.tensors.len(), true), &self.tensors),
            config: config.clone(),
            layout: self.layout,
            backward,
            tensors: self.tensors,
            ops: self.ops,
            blocks: time.blocks.len(),
            by_weight: group_by_weight(&self.maps),
            maps: self.maps,
            time,
            forward_len: self.forward_len,
            backward_len: self.backward_len,
            attentions: self.attentions,
        }
    }

    fn tensor(&mut self, shift: usize, channels: usize, halo: usize) -> usize {
        self.tensors.push(Tensor {
            shift,
            channels,
            halo,
        });
        self.tensors.len() - 1
    }

    /// Offset of a parameter, if the network has it.
    fn find(&self, name: &str) -> Option<usize> {
        self.layout.find(name).map(|spec| spec.offset)
    }

    /// Offset of a parameter that the layout has by construction.
    fn offset(&self, name: &str) -> usize {
        self.find(name)
            .unwrap_or_else(|| panic!("the layout has `{name}`"))
    }

    /// The map of a layer whose input channels come in `parts`.
    fn map(&mut self, name: &str, form: Form, parts: &[usize], standardised: bool) -> usize {
        let weight = format!("{name}.weight");
        let spec = self.layout.find(&weight);
        let (outputs, weight_len) = spec.map_or((0, 0), |spec| (spec.shape[0], spec.size()));
        let map = LinearMap {
            weight: self.offset(&weight),
            form,
            inputs: parts.iter().sum(),
            outputs,
            rows: vec![(0, outputs)],
            bias: self.find(&format!("{name}.bias")),
            gain: None,
            standardised,
            parts: Vec::new(),
            gradient_len: 0,
            weight_len,
        };
        self.add(map, parts)
    }

    /// Lays out a map's matrices and files it.
    fn add(&mut self, mut map: LinearMap, parts: &[usize]) -> usize {
        let mut first = 0;
        for &channels in parts {
            let place = |applications: Vec<_>, inner: usize, n: usize, len: &mut usize| {
                let matrices =
                    applications
                        .into_iter()
                        .map(|application: crate::linear_map::Application| {
                            let k = application.taps.len() * inner;
                            let offset = *len;
                            *len += packed_len(k, n);
                            Matrix {
                                application,
                                offset,
                                k,
                                n,
                            }
                        });
                matrices.collect::<Vec<_>>()
            };
            let forward = place(
                map.form.forward(),
                channels,
                map.outputs,
                &mut self.forward_len,
            );
            let backward = place(
                map.form.backward(),
                map.outputs,
                channels,
                &mut self.backward_len,
            );
            let mut gradient = Vec::new();
            for matrix in &forward {
                gradient.push(map.gradient_len);
                map.gradient_len += matrix.k * matrix.n;
            }
            map.parts.push(Part {
                first,
                channels,
                forward,
                backward,
                gradient,
            });
            first += channels;
        }
        self.maps.push(map);
        self.maps.len() - 1
    }

    fn convolution(
        &mut self,
        name: &str,
        form: Form,
        input: usize,
        shift: usize,
        channels: usize,
    ) -> usize {
        let map = self.map(name, form, &[self.tensors[input].channels], false);
        let output = self.tensor(shift, channels, 1);
        self.ops.push(Op::Map { map, input, output });
        output
    }

    fn norm(&self, name: &str) -> NormAt {
        NormAt {
            gain: self.offset(&format!("{name}.weight")),
            offset: self.offset(&format!("{name}.bias")),
        }
    }

    fn block(&mut self, name: &str, inputs: &[usize], channels: usize) -> usize {
        let parts: Vec<usize> = inputs.iter().map(|&i| self.tensors[i].channels).collect();
        let time = self.map(
            &format!("{name}.time"),
            Form::Same(1),
            &[self.config.time_width()],
            false,
        );
        let time_column = self.time_columns;
        let index = self.time_blocks.len();
        self.time_blocks.push((time, time_column));
        self.time_columns += 2 * channels;

        let conv1 = self.map(&format!("{name}.conv1"), Form::Same(3), &parts, true);
        let conv2 = self.map(&format!("{name}.conv2"), Form::Same(3), &[channels], true);
        let residual = format!("{name}.residual");
        let residual = self
            .find(&format!("{residual}.weight"))
            .map(|_| self.map(&residual, Form::Same(1), &parts, false));
        let output = self.tensor(self.tensors[inputs[0]].shift, channels, 1);
        self.ops.push(Op::Block(Block {
            index,
            inputs: inputs.to_vec(),
            output,
            conv1,
            norm1: self.norm(&format!("{name}.norm1")),
            conv2,
            norm2: self.norm(&format!("{name}.norm2")),
            residual,
            time_column,
        }));
        output
    }

    fn attention(&mut self, name: &str, input: usize) -> usize {
        let Tensor {
            shift, channels, ..
        } = self.tensors[input];
        let (dim, inner) = (self.config.head_dim, self.config.attention_width());
        let heads = (0..self.config.heads).map(|head| {
            let map = LinearMap {
                weight: self.offset(&format!("{name}.qkv.weight")),
                form: Form::Same(1),
                inputs: channels,
                outputs: 3 * dim,
                // Query, key, value; within each, head by head.
                rows: (0..3)
                    .map(|which| (which * inner + head * dim, dim))
                    .collect(),
                bias: None,
                gain: Some(self.offset(&format!("{name}.norm.weight"))),
                standardised: false,
                parts: Vec::new(),
                gradient_len: 0,
                weight_len: 3 * inner * channels,
            };
            self.add(map, &[channels])
        });
        let heads = heads.collect();
        let out = self.map(&format!("{name}.out"), Form::Same(1), &[inner], false);
        let output = self.tensor(shift, channels, 1);
        let index = self.attentions;
        self.attentions += 1;
        self.ops.push(Op::Attention(Attention {
            index,
            input,
            output,
            heads,
            out,
        }));
        output
    }
}
