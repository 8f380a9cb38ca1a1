//! Products against their definition, on every instruction set and on sizes that fill no tile.

use super::*;
use crate::simd::{Instructions, Isa};

/// Small integers: every sum is exact, so results are compared for equality.
fn numbers(count: usize, seed: usize) -> Vec<f32> {
    let number = |i: usize| ((i * 7919 + seed * 104_729) % 23) as f32 - 11.0;
    (0..count).map(number).collect()
}

fn pack(matrix: &[f32], k: usize, n: usize) -> Vec<f32> {
    let mut packed = vec![0.0; packed_len(k, n)];
    for row in 0..k {
        for column in 0..n {
            let panel = column / PANEL * PANEL;
            let width = panel_width(n, panel);
            packed[panel * k + row * width + (column - panel)] = matrix[row * n + column];
        }
    }
    packed
}

fn sets() -> impl Iterator<Item = Isa> {
    Instructions::ALL.into_iter().filter_map(Isa::new)
}

const SHAPES: [(usize, usize, usize, usize); 9] = [
    (1, 1, 1, 1),
    (2, 5, 3, 3),
    (1, 128, 24, 32),
    (3, 16, 9, 96),
    (2, 23, 17, 33),
    (1, 31, 40, 48),
    (2, 7, 8, 16),
    (1, 19, 12, 50),
    (4, 2, 6, 8),
];

#[test]
fn multiply_is_the_product_plus_bias_and_addend() {
    for (samples, rows, k, n) in SHAPES {
        // Rows overlap, as those of a convolution; results lie between others' numbers.
        let (row, sample) = (k.div_ceil(3), rows * k + 5);
        let (to_row, to_sample) = (n + 3, rows * (n + 3) + 2);
        let left = numbers(samples * sample + k, 1);
        let (right, bias) = (numbers(k * n, 2), numbers(n, 3));
        let addend = numbers(samples * to_sample + 4, 4);
        let before = numbers(samples * to_sample + 4, 5);
        let packed = pack(&right, k, n);
        for isa in sets() {
            for which in 0..3 {
                let mut out = before.clone();
                let other = Operand {
                    data: &addend,
                    start: 4,
                    sample: to_sample,
                    row: to_row,
                };
                let add = [Add::Nothing, Add::Target, Add::Other(other)][which];
                let bias = (which != 1).then_some(&bias[..]);
                let lhs = Operand {
                    data: &left,
                    start: 2,
                    sample,
                    row,
                };
                let to = Target {
                    data: &mut out,
                    start: 4,
                    sample: to_sample,
                    row: to_row,
                };
                multiply(isa, samples, rows, k, n, lhs, &packed, bias, add, to);

                let mut expected = before.clone();
                for s in 0..samples {
                    for r in 0..rows {
                        for c in 0..n {
                            let at = 4 + s * to_sample + r * to_row + c;
                            let x = &left[2 + s * sample + r * row..][..k];
                            let product: f32 = (0..k).map(|i| x[i] * right[i * n + c]).sum();
                            let added = [0.0, before[at], addend[at]][which];
                            expected[at] = product + bias.map_or(0.0, |bias| bias[c]) + added;
                        }
                    }
                }
                assert_eq!(
                    out, expected,
                    "{isa:?} {samples}x{rows}x{k}x{n}, addend {which}"
                );
            }
        }
    }
}

#[test]
fn outer_sums_over_samples_and_rows() {
    for (samples, rows, k, n) in SHAPES {
        let (row, sample) = (k.div_ceil(3), rows * k + 5);
        let (to_row, to_sample) = (n + 3, rows * (n + 3) + 2);
        let left = numbers(samples * sample + k, 1);
        let right = numbers(samples * to_sample + 4, 2);
        let before = numbers(k * n, 3);
        for isa in sets() {
            for accumulate in [false, true] {
                let mut out = before.clone();
                let mut scratch = vec![f32::NAN; samples * rows * PANEL];
                let lhs = Operand {
                    data: &left,
                    start: 2,
                    sample,
                    row,
                };
                let rhs = Operand {
                    data: &right,
                    start: 4,
                    sample: to_sample,
                    row: to_row,
                };
                outer(
                    isa,
                    samples,
                    rows,
                    k,
                    n,
                    lhs,
                    rhs,
                    &mut scratch,
                    accumulate,
                    &mut out,
                );
                for i in 0..k {
                    for c in 0..n {
                        let mut sum = if accumulate { before[i * n + c] } else { 0.0 };
                        for s in 0..samples {
                            for r in 0..rows {
                                let x = left[2 + s * sample + r * row + i];
                                sum += x * right[4 + s * to_sample + r * to_row + c];
                            }
                        }
                        assert_eq!(out[i * n + c], sum, "{isa:?} {samples}x{rows}x{k}x{n}");
                    }
                }
            }
        }
    }
}

#[test]
#[should_panic(expected = "reach")]
fn an_operand_that_ends_too_early_is_refused() {
    let isa = Isa::detect();
    let (data, packed, mut out) = ([0.0; 11], [0.0; 3 * 16], [0.0; 4]);
    let lhs = Operand {
        data: &data,
        start: 0,
        sample: 0,
        row: 3,
    };
    let to = Target {
        data: &mut out,
        start: 0,
        sample: 0,
        row: 1,
    };
    multiply(isa, 1, 4, 3, 1, lhs, &packed, None, Add::Nothing, to);
}
