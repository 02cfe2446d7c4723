//! Contact and supports on a part of an edge or a group: `from`, `box`, `where`; at chosen nodes of it: `nodes`.

use super::nodes::check_once;
use super::number::{Check, finite, length};
use super::{BodyKind, Field, Issue, Scene};
use crate::mesh::Point;

/// Which sides of a group an obstacle faces: those whose middle lies there. Or which of its nodes.
#[derive(Debug, Clone)]
pub enum Portion {
    /// Between two shares of the length of the group, from its beginning.
    From([f64; 2]),
    /// In a box along the axes.
    Box([Vec<f64>; 2]),
    /// Where conditions hold.
    Where {
        /// As they stand in the scene.
        text: String,
        /// Expressions, each less than the next, or at most that.
        chains: Vec<Vec<Field>>,
    },
    /// At nodes, by their numbers in the file of the mesh, of generated bodies from 0: without an area.
    Nodes(Vec<i64>),
}

/// The keys of a table that choose a part, of which one may be given.
#[derive(Debug, Default)]
pub(super) struct Keys<'a> {
    pub from: Option<[f64; 2]>,
    pub r#box: Option<&'a [Vec<f64>; 2]>,
    pub nodes: Option<&'a [i64]>,
    pub r#where: Option<&'a str>,
}

/// So many nodes are written out in a name.
const WRITTEN: usize = 4;

/// Words between conditions that all hold.
const AND: &str = " and ";

impl Portion {
    /// Conditions such as `x > 0.9`, `0.2 < y < 0.5 and x > 0`.
    pub(super) fn condition(text: &str) -> Result<Portion, String> {
        let help = "give comparisons of expressions of x, y and z, joined by \"and\": \"x > 0.9\", \"0.2 < y < 0.5 and x > 0\"";
        let chain = |part: &str| -> Result<Vec<Field>, String> {
            let greater = part.contains('>');
            if greater == part.contains('<') {
                return Err(format!("cannot read the condition `{}`: {help}", part.trim()));
            }
            let sign = if greater { '>' } else { '<' };
            // sides of a strict and of a weak comparison are the same: middles lie on no border
            let sides = part.split(sign).map(|side| side.strip_prefix('=').unwrap_or(side));
            let mut fields =
                sides.map(|s| Field::parse(s.trim())).collect::<Result<Vec<_>, _>>()?;
            if greater {
                fields.reverse();
            }
            Ok(fields)
        };
        let chains = text.split(AND).map(chain).collect::<Result<_, _>>()?;
        Ok(Portion::Where { text: text.to_owned(), chains })
    }

    /// The part that a table chooses, if it does; `key` is where its keys stand.
    pub(super) fn given(
        keys: &Keys,
        key: &dyn Fn(&str) -> String,
    ) -> Result<Option<Portion>, Issue> {
        let of_condition = |text: &str| {
            Portion::condition(text)
                .map_err(|why| Issue::new(key("where"), why, "where = \"x > 0.9\""))
        };
        let given = [
            keys.from.map(Portion::From),
            keys.r#box.cloned().map(Portion::Box),
            keys.nodes.map(|nodes| Portion::Nodes(nodes.to_vec())),
            keys.r#where.map(of_condition).transpose()?,
        ];
        let mut given = given.into_iter().flatten();
        match (given.next(), given.next()) {
            (Some(one), Some(other)) => {
                let message = format!("stands beside {}", one.key());
                Err(Issue::new(key(other.key()), message, "give one of them"))
            }
            (one, _) => Ok(one),
        }
    }

    /// What the group is called whose sides these are.
    pub(super) fn name(&self, group: &str) -> String {
        match self {
            Portion::From([a, b]) => format!("{group} from {a} to {b}"),
            Portion::Box([low, high]) => format!("{group} in {low:?} to {high:?}"),
            Portion::Where { text, .. } => format!("{group} where {text}"),
            Portion::Nodes(nodes) => {
                let first = nodes.iter().take(WRITTEN).map(i64::to_string).collect::<Vec<_>>();
                let rest = nodes.len() - first.len();
                let more = if rest > 0 { format!(" and {rest} more") } else { String::new() };
                format!("{group} at {}{more}", first.join(", "))
            }
        }
    }

    /// The key of the scene.
    pub(crate) fn key(&self) -> &'static str {
        match self {
            Portion::From(_) => "from",
            Portion::Box(_) => "box",
            Portion::Where { .. } => "where",
            Portion::Nodes(_) => "nodes",
        }
    }

    /// Whether a side is one of them, by its middle, and that over the length of the group.
    pub(crate) fn has(&self, middle: Point, share: f64) -> bool {
        match self {
            Portion::From([a, b]) => (*a..=*b).contains(&share),
            Portion::Box([low, high]) => {
                let inside = |c: usize| low[c] <= middle[c] && middle[c] <= high[c];
                (0..low.len()).all(inside)
            }
            Portion::Where { chains, .. } => chains.iter().all(|chain| {
                let values: Vec<f64> = chain.iter().map(|f| f.at(middle)).collect();
                values.windows(2).all(|w| w[0] <= w[1])
            }),
            Portion::Nodes(_) => false,
        }
    }

    /// What is wrong with it by itself.
    pub(super) fn check(&self, scene: &Scene, key: &dyn Fn(&str) -> String) -> Check {
        let issue = |message: &str, help: &str| Err(Issue::new(key(self.key()), message, help));
        if scene.body.kind == BodyKind::Matrices || scene.dim() == 1 {
            let message = "chooses sides of an edge or a group, and this body has none";
            return issue(message, "remove the key");
        }
        match self {
            Portion::From(_) if scene.dim() == 3 => issue(
                "is a range along a line, and faces are in no order",
                "give box = [[x0, y0, z0], [x1, y1, z1]], or where = \"x > 0.9\"",
            ),
            Portion::From([a, b]) if !(0.0 <= *a && a < b && *b <= 1.0) => issue(
                "is no range",
                "give two shares of the length of the edge, the lower first: [0.9, 1.0] is its last tenth",
            ),
            Portion::From(_) => Ok(()),
            Portion::Box(corners) => {
                let dim = scene.dim();
                for corner in corners {
                    length(&key("box"), corner.len(), dim, "[[0.9, 0.0], [1.0, 0.5]]")?;
                    corner.iter().try_for_each(|x| finite(&key("box"), *x))?;
                }
                match (0..dim).all(|c| corners[0][c] <= corners[1][c]) {
                    true => Ok(()),
                    false => issue("is empty", "give the lower corner first"),
                }
            }
            Portion::Where { chains, .. } => {
                let in_space = chains.iter().flatten().any(Field::is_in_space);
                match in_space && scene.dim() < 3 {
                    true => issue(
                        "is a condition on z, and the body lies in the plane of x and y",
                        "give a condition on x and y",
                    ),
                    false => Ok(()),
                }
            }
            Portion::Nodes(nodes) if nodes.is_empty() => {
                issue("names no node", "nodes = [12, 17], or remove the key")
            }
            Portion::Nodes(nodes) => check_once(nodes, || key("nodes")),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::Portion;

    #[test]
    fn conditions_are_read_as_they_stand() {
        let has = |text: &str, p| Portion::condition(text).unwrap().has(p, 0.0);
        assert!(has("x > 0.9", [1.0, 0.0, 0.0]) && !has("x > 0.9", [0.8, 0.0, 0.0]));
        let both = "0.2 < y <= 2*x and x>=0.5";
        assert!(has(both, [0.6, 1.0, 0.0]) && !has(both, [0.4, 0.5, 0.0]));
        assert!(!has(both, [0.6, 0.1, 0.0]) && !has(both, [0.6, 1.3, 0.0]));
        assert!(has("0.5 > y > -x^2", [1.0, 0.0, 0.0]) && !has("0.5 > y > -x^2", [1.0, 0.6, 0.0]));
        for bad in ["x", "x > 1 < y", "x > ", "q > 1", "x = 1", ""] {
            assert!(Portion::condition(bad).is_err(), "{bad}");
        }
    }
}
