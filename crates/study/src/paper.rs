//! The numbers the paper prints, to stand beside ours.

/// The pairs of sets in the order of the paper's columns, ID first.
const COLUMNS: [(char, char); 6] = [
    ('O', 'K'),
    ('K', 'O'),
    ('O', 'I'),
    ('I', 'O'),
    ('K', 'I'),
    ('I', 'K'),
];

/// A printed row: its name here, and AUROC in the order of [`COLUMNS`].
type Row = (&'static str, [f64; 6]);

/// Table 1, trained on KITTI.
const RESULTS: [Row; 5] = [
    ("jem", [0.211, 0.786, 0.437, 0.561, 0.631, 0.336]),
    ("glow", [0.461, 0.556, 0.470, 0.539, 0.529, 0.454]),
    ("r3", [0.362, 0.770, 0.417, 0.585, 0.793, 0.409]),
    ("paper12", [0.845, 0.952, 1.000, 0.398, 1.000, 0.234]),
    ("paper24", [1.000, 0.956, 1.000, 0.931, 1.000, 0.897]),
];

/// The tables of training sets, sequence lengths and diffusion steps, all with the 24 statistics but
/// where the name says R^3. The row of IROS20 is announced in the text and not printed.
const ABLATIONS: [Row; 10] = [
    ("O r3", [0.897, 0.327, 0.890, 0.378, 0.464, 0.532]),
    ("O paper24", [0.934, 0.999, 1.000, 0.124, 1.000, 0.433]),
    ("K r3", [0.362, 0.770, 0.417, 0.585, 0.793, 0.409]),
    ("K paper24", [1.000, 0.956, 1.000, 0.931, 1.000, 0.897]),
    ("64 poses", [1.000, 0.999, 1.000, 0.986, 0.999, 0.976]),
    ("128 poses", [1.000, 0.956, 1.000, 0.931, 1.000, 0.897]),
    ("256 poses", [0.980, 0.961, 1.000, 0.941, 1.000, 0.932]),
    ("512 poses", [1.000, 0.999, 1.000, 0.942, 1.000, 0.923]),
    ("5 steps", [0.916, 0.969, 1.000, 0.955, 1.000, 0.945]),
    ("10 steps", [0.914, 0.975, 1.000, 0.938, 1.000, 0.945]),
];

/// The rest of the table of diffusion steps.
const STEPS: [Row; 2] = [
    ("15 steps", [0.948, 0.964, 1.000, 0.919, 1.000, 0.912]),
    ("30 steps", [1.000, 0.956, 1.000, 0.942, 1.000, 0.897]),
];

/// AUROC that the paper prints for a row and `(ID letter, OOD letter)`.
pub fn printed(row: &str, id: char, ood: char) -> Option<f64> {
    let column = COLUMNS.iter().position(|cell| *cell == (id, ood))?;
    let mut rows = RESULTS.iter().chain(&ABLATIONS).chain(&STEPS);
    Some(rows.find(|(name, _)| *name == row)?.1[column])
}
