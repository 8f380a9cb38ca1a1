//! Throughput of the engine on a UNet pair, beside the machine's sgemm speed and PyTorch.
//!
//! `cargo bench -p dose3-engine -- --width 32 --multipliers 1,2,4,8 --batch 32 --length 128`;
//! `--pytorch PYTHON` takes turns with PyTorch (`xtask/pytorch/bench.py`) in the same run, and
//! further words after `--` go to that script. Times are the best of all turns: on a shared
//! machine that is what repeats.
#![allow(clippy::print_stdout)]

use std::io::{BufRead, BufReader, Write};
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};
use std::time::Instant;

use dose3_engine::{Adam, AdamConfig, Engine, EngineOptions};
use dose3_model::{Input, NoiseModel, PairConfig, PairParameters};

type Failure = Box<dyn std::error::Error>;

#[derive(Clone)]
struct Options {
    width: usize,
    multipliers: Vec<usize>,
    batch: usize,
    length: usize,
    rounds: usize,
    seconds: f64,
    pytorch: Option<String>,
    extra: Vec<String>,
}

fn options() -> Result<Options, Failure> {
    let mut options = Options {
        width: 32,
        multipliers: vec![1, 2, 4, 8],
        batch: 32,
        length: 128,
        rounds: 3,
        seconds: 1.0,
        pytorch: None,
        extra: Vec::new(),
    };
    let mut args = std::env::args().skip(1);
    while let Some(arg) = args.next() {
        let mut value = || args.next().ok_or(format!("{arg} needs a value"));
        match arg.as_str() {
            "--width" => options.width = value()?.parse()?,
            "--multipliers" => {
                options.multipliers = value()?
                    .split(',')
                    .map(str::parse)
                    .collect::<Result<_, _>>()?;
            }
            "--batch" => options.batch = value()?.parse()?,
            "--length" => options.length = value()?.parse()?,
            "--rounds" => options.rounds = value()?.parse()?,
            "--seconds" => options.seconds = value()?.parse()?,
            "--pytorch" => options.pytorch = Some(value()?),
            "--bench" => {}
            "--" => options.extra = args.by_ref().collect(),
            other => return Err(format!("unknown option {other}").into()),
        }
    }
    Ok(options)
}

/// The shortest time of a call among those of `seconds`.
fn best(seconds: f64, mut work: impl FnMut()) -> f64 {
    let start = Instant::now();
    let mut best = f64::INFINITY;
    while best.is_infinite() || start.elapsed().as_secs_f64() < seconds {
        let begin = Instant::now();
        work();
        best = best.min(begin.elapsed().as_secs_f64());
    }
    best
}

/// GFLOP/s of one thread on a square product, by the gemm crate.
fn peak(seconds: f64) -> f64 {
    const N: usize = 768;
    let (a, b, mut c) = (vec![1f32; N * N], vec![1f32; N * N], vec![0f32; N * N]);
    let n = N as isize;
    let time = best(seconds, || {
        // SAFETY: three N x N matrices, row-major.
        unsafe {
            gemm::gemm(
                N,
                N,
                N,
                c.as_mut_ptr(),
                1,
                n,
                false,
                a.as_ptr(),
                1,
                n,
                b.as_ptr(),
                1,
                n,
                0f32,
                1f32,
                false,
                false,
                false,
                gemm::Parallelism::None,
            );
        }
    });
    2.0 * (N * N * N) as f64 / time / 1e9
}

struct Net {
    engine: Engine,
    adam: Adam,
    values: Vec<f32>,
    gradient: Vec<f32>,
    x: Vec<f32>,
    output: Vec<f32>,
}

struct Pair {
    nets: Vec<Net>,
    steps: Vec<f32>,
    options: Options,
}

impl Pair {
    fn new(options: &Options, threads: usize) -> Result<Self, Failure> {
        let config = PairConfig::new(options.width, &options.multipliers);
        let parameters = PairParameters::init(&config, 1)?;
        let samples = options.batch * options.length;
        let nets = [parameters.translation, parameters.rotation].map(|parameters| {
            let channels = parameters.config.in_channels;
            let engine_options = EngineOptions {
                threads,
                ..EngineOptions::default()
            };
            Ok::<_, Failure>(Net {
                engine: Engine::new(&parameters, engine_options)?,
                adam: Adam::new(&parameters.values, AdamConfig::default()),
                gradient: vec![0.0; parameters.values.len()],
                values: parameters.values,
                x: (0..samples * channels)
                    .map(|i| (i as f32 * 0.37).sin())
                    .collect(),
                output: vec![0.0; samples * 3],
            })
        });
        Ok(Self {
            nets: nets.into_iter().collect::<Result<_, _>>()?,
            steps: (0..options.batch).map(|i| (i % 30) as f32).collect(),
            options: options.clone(),
        })
    }

    fn forward(&mut self) {
        let Options { batch, length, .. } = self.options;
        for net in &mut self.nets {
            let input = Input {
                x: &net.x,
                steps: &self.steps,
                batch,
                length,
            };
            net.engine.forward(input, &mut net.output).expect("forward");
        }
    }

    fn train(&mut self) {
        let Options { batch, length, .. } = self.options;
        let scale = 2.0 / (batch * length * 3) as f32;
        for net in &mut self.nets {
            let input = Input {
                x: &net.x,
                steps: &self.steps,
                batch,
                length,
            };
            let loss = |_: usize, output: &[f32], gradient: &mut [f32]| {
                for (g, o) in gradient.iter_mut().zip(output) {
                    *g = scale * o;
                }
            };
            net.engine
                .forward_backward(input, &loss, &mut net.gradient)
                .expect("backward");
            net.adam.step(&mut net.values, &net.gradient, 1e-4, 0.995);
            net.engine.set_parameters(&net.values).expect("finite");
        }
    }

    fn flops(&self) -> f64 {
        let flops = |net: &Net| net.engine.flops(self.options.length) as f64;
        self.options.batch as f64 * self.nets.iter().map(flops).sum::<f64>()
    }
}

struct Pytorch {
    child: Child,
    ask: ChildStdin,
    answer: BufReader<ChildStdout>,
}

impl Pytorch {
    fn start(python: &str, options: &Options) -> Result<Self, Failure> {
        let script = concat!(env!("CARGO_MANIFEST_DIR"), "/../../xtask/pytorch/bench.py");
        let multipliers: Vec<String> = options.multipliers.iter().map(usize::to_string).collect();
        let mut child = Command::new(python)
            .arg(script)
            .args(["--width", &options.width.to_string()])
            .args(["--multipliers", &multipliers.join(",")])
            .args(["--batch", &options.batch.to_string()])
            .args(["--length", &options.length.to_string()])
            .args(["--seconds", &options.seconds.to_string()])
            .args(&options.extra)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()?;
        let ask = child.stdin.take().ok_or("no standard input")?;
        let answer = BufReader::new(child.stdout.take().ok_or("no standard output")?);
        Ok(Self { child, ask, answer })
    }

    fn time(&mut self, what: &str) -> Result<f64, Failure> {
        writeln!(self.ask, "{what}")?;
        self.ask.flush()?;
        let mut line = String::new();
        self.answer.read_line(&mut line)?;
        Ok(line.trim().parse()?)
    }
}

fn main() -> Result<(), Failure> {
    let options = options()?;
    let threads = std::thread::available_parallelism()?.get().min(2);
    let mut engines = Vec::new();
    for count in 1..=threads {
        engines.push((count, Pair::new(&options, count)?, [f64::INFINITY; 2]));
    }
    let mut pytorch = match &options.pytorch {
        Some(python) => Some(Pytorch::start(python, &options)?),
        None => None,
    };
    let (mut sgemm, mut torch) = (0f64, [f64::INFINITY; 2]);
    for _ in 0..options.rounds {
        sgemm = sgemm.max(peak(options.seconds / 4.0));
        for (_, pair, times) in &mut engines {
            times[0] = times[0].min(best(options.seconds, || pair.forward()));
            times[1] = times[1].min(best(options.seconds, || pair.train()));
        }
        if let Some(pytorch) = &mut pytorch {
            torch[0] = torch[0].min(pytorch.time("forward")?);
            torch[1] = torch[1].min(pytorch.time("train")?);
        }
    }
    let Options {
        width,
        multipliers,
        batch,
        length,
        ..
    } = &options;
    println!(
        "pair, width {width}, multipliers {multipliers:?}, batch {batch}, length {length}, {:?}",
        engines[0].1.nets[0].engine.instructions()
    );
    println!("sgemm, one thread: {sgemm:.0} GFLOP/s");
    let batch = *batch as f64;
    for (count, pair, times) in &engines {
        for (what, time, factor) in [("forward", times[0], 1.0), ("train", times[1], 3.0)] {
            let speed = factor * pair.flops() / time / 1e9;
            println!(
                "engine {count} thread(s) {what:8} {:9.1} windows/s {:7.2} ms {speed:6.0} GFLOP/s",
                batch / time,
                time * 1e3
            );
        }
    }
    if let Some(Pytorch { child, ask, .. }) = pytorch {
        drop(ask);
        let mut child = child;
        child.wait()?;
        let ours = engines.last().map_or([0.0; 2], |engine| engine.2);
        for (i, what) in ["forward", "train"].iter().enumerate() {
            println!(
                "pytorch 2 threads  {what:8} {:9.1} windows/s {:7.2} ms; engine {:.2} times as fast",
                batch / torch[i],
                torch[i] * 1e3,
                torch[i] / ours[i]
            );
        }
    }
    if let [one, two] = &engines[..] {
        let gain = [one.2[0] / two.2[0], one.2[1] / two.2[1]];
        println!(
            "two threads over one: forward {:.2}, train {:.2}",
            gain[0], gain[1]
        );
    }
    Ok(())
}
