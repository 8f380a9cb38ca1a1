//! Whether the quaternions of a file without a header have w first or last.

use dose3_lie::{Rotation, Vector};
use nalgebra::{Quaternion, UnitQuaternion};

use super::guess::{self, DECIDED, OVERRULED};
use super::layout::{Layout, Order};
use super::one_way::OneWay;
use crate::{Format, ReadOption, Remark, RemarkKind};

/// Fewest poses by whose motion a header or the habit of a format is overruled: of four turned at random one order often is
/// ten times more even than the other.
const FEWEST_TO_OVERRULE: usize = 20;
/// A quaternion w, x, y, z that turns nothing.
const IDENTITY: [f64; 4] = [1.0, 0.0, 0.0, 0.0];

/// The columns of w, x, y, z, and a remark where they are not plain.
///
/// `usual` are those that the header or the habit of the format says, `numbers` the quaternions w, x, y, z of the first
/// rows read so.
pub(super) fn quaternion(
    layout: &Layout,
    usual: [usize; 4],
    positions: &[Vector],
    numbers: &[[f64; 4]],
) -> ([usize; 4], Option<Remark>) {
    let [w, x, y, z] = usual;
    let last = w == z + 1 && y == x + 1 && z == y + 1;
    let first = x == w + 1 && y == x + 1 && z == y + 1;
    if !first && !last {
        return (usual, None);
    }
    // The other order of the same four columns.
    let other = if last { [x, y, z, w] } else { [z, w, x, y] };
    let turned = |q: [f64; 4]| {
        if last {
            [q[1], q[2], q[3], q[0]]
        } else {
            [q[3], q[0], q[1], q[2]]
        }
    };
    let as_usual: Vec<Rotation> = numbers.iter().map(|q| rotation(*q)).collect();
    let as_other: Vec<Rotation> = numbers.iter().map(|q| rotation(turned(*q))).collect();
    let ratio = guess::preference(positions, &as_usual, &as_other);
    let one_way = |rotations: &[Rotation]| OneWay::new(positions, rotations);
    let one_way = one_way(&as_usual).zip(one_way(&as_other));

    let headed = layout.order == Order::Header;
    let settled = headed || layout.format == Format::Tum;
    let words = |last: bool| if last { "x, y, z, w" } else { "w, x, y, z" };
    let (this, that) = (words(last), words(!last));
    let said = if headed {
        "the header"
    } else {
        "the habit of the format"
    };
    let remark = |text: String| {
        Some(Remark::new(RemarkKind::QuaternionOrder, text).option(ReadOption::Columns))
    };

    let needed = if settled { OVERRULED } else { DECIDED };
    let enough = !settled || numbers.len() >= FEWEST_TO_OVERRULE;
    if enough && ratio * needed < 1.0 {
        let text = format!(
            "quaternions are taken as {that}: so the body moves {:.0} times more evenly along its own axes than as {this}, which {said} would say",
            1.0 / ratio
        );
        return (other, remark(text));
    }
    // Files with w last are the many: nothing but a name or the numbers says that one has it first.
    if let Some((here, there)) = one_way
        && last
        && !headed
        && enough
        && there.beats(here)
    {
        let text = format!(
            "quaternions are taken as {that}: so the body moves along one direction of its own (1 - |mean direction| is {:.4} in the body frame), and not as {this}, which {said} would say ({:.2})",
            there.spread, here.spread
        );
        return (other, remark(text));
    }
    if headed {
        return (usual, None);
    }
    let unsaid = |text: String| if settled { None } else { remark(text) };
    if ratio > DECIDED {
        let text = format!(
            "quaternions are taken as {this}: so the body moves {ratio:.0} times more evenly along its own axes than as {that}"
        );
        return (usual, unsaid(text));
    }
    if let Some((here, there)) = one_way
        && here.beats(there)
    {
        let text = format!(
            "quaternions are taken as {this}: so the body moves along one direction of its own (1 - |mean direction| is {:.4} in the body frame), and not as {that} ({:.2})",
            here.spread, there.spread
        );
        return (usual, unsaid(text));
    }
    let start = numbers.first().copied().unwrap_or_default();
    if turned(start) == IDENTITY {
        let text = format!(
            "quaternions are taken as {that}: so the log begins without a rotation; the motion does not tell"
        );
        return (other, remark(text));
    }
    if settled && start == IDENTITY {
        return (usual, None);
    }
    let text = format!(
        "quaternions are taken as {this}, the habit of such files; neither header nor motion tells"
    );
    (usual, remark(text))
}

fn rotation([w, x, y, z]: [f64; 4]) -> Rotation {
    UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z)).to_rotation_matrix()
}
