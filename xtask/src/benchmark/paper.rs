//! The numbers the paper prints (table 1), to stand beside ours.

/// AUROC of the paper's table 1 for `(method, ID letter, OOD letter)`.
pub fn printed(method: &str, id: char, ood: char) -> Option<f64> {
    let row = match method {
        "r3" => [0.362, 0.770, 0.417, 0.585, 0.793, 0.409],
        "paper12" => [0.845, 0.952, 1.000, 0.398, 1.000, 0.234],
        "paper24" => [1.000, 0.956, 1.000, 0.931, 1.000, 0.897],
        _ => return None,
    };
    let column = [
        ('O', 'K'),
        ('K', 'O'),
        ('O', 'I'),
        ('I', 'O'),
        ('K', 'I'),
        ('I', 'K'),
    ]
    .iter()
    .position(|cell| *cell == (id, ood))?;
    Some(row[column])
}
