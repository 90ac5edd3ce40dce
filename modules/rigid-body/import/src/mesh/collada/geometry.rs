//! Triangles of one `<geometry>`: corners from its sources, faces from its lists.

use super::{Triangle, child, list, referred, wrong};
use nalgebra::Vector3;
use roxmltree::Node;
use std::collections::HashMap;

type Ids<'a> = HashMap<&'a str, Node<'a, 'a>>;

/// All faces, cut into triangles.
pub(super) fn triangles<'a>(geometry: Node<'a, 'a>, ids: &Ids<'a>) -> Result<Vec<Triangle>, String> {
    let mesh =
        child(geometry, "mesh").ok_or_else(|| wrong(geometry, "is not a <mesh>; splines are not read"))?;
    let mut out = Vec::new();
    for part in mesh.children().filter(Node::is_element) {
        let kind = part.tag_name().name();
        if ["triangles", "polylist", "polygons", "trifans", "tristrips"].contains(&kind) {
            faces(part, ids, &mut out)?;
        }
    }
    Ok(out)
}

/// A list of faces.
fn faces<'a>(part: Node<'a, 'a>, ids: &Ids<'a>, out: &mut Vec<Triangle>) -> Result<(), String> {
    let inputs = || part.children().filter(|n| n.has_tag_name("input"));
    let offset = |n: Node| n.attribute("offset").and_then(|o| o.parse::<usize>().ok()).unwrap_or(0);
    let vertex = inputs().find(|n| n.attribute("semantic") == Some("VERTEX"));
    let vertex = vertex.ok_or_else(|| wrong(part, "has no <input semantic=\"VERTEX\">"))?;
    let corners = positions(referred(ids, vertex, "source")?, ids)?;
    let (at, stride) = (offset(vertex), inputs().map(offset).max().unwrap_or(0) + 1);
    let corner =
        |k: &usize| corners.get(*k).copied().ok_or_else(|| wrong(part, "names a corner that is not there"));
    // The corners of each <p>.
    let mut lists = Vec::new();
    for p in part.children().filter(Node::is_element) {
        match p.tag_name().name() {
            "p" => {
                let all: Vec<usize> = list(p)?;
                let these = all.chunks_exact(stride).map(|c| corner(&c[at]));
                lists.push(these.collect::<Result<Vec<_>, _>>()?);
            }
            "ph" => {
                return Err(wrong(
                    p,
                    "polygons with holes are not read; let the mesh editor write triangles",
                ));
            }
            _ => {}
        }
    }
    match part.tag_name().name() {
        "triangles" => out.extend(lists.iter().flat_map(|l| l.chunks_exact(3)).map(|c| [c[0], c[1], c[2]])),
        "polylist" => {
            let counts: Vec<usize> = child(part, "vcount").map(list).transpose()?.unwrap_or_default();
            let mut rest = lists.first().map(Vec::as_slice).unwrap_or_default();
            for n in counts {
                let (polygon, after) = rest
                    .split_at_checked(n)
                    .ok_or_else(|| wrong(part, "<vcount> names more corners than <p>"))?;
                cut(polygon, out);
                rest = after;
            }
        }
        "polygons" => lists.iter().for_each(|l| cut(l, out)),
        "trifans" => {
            let fan = |l: &Vec<[f64; 3]>| -> Vec<Triangle> {
                l.windows(2).skip(1).map(|w| [l[0], w[0], w[1]]).collect()
            };
            out.extend(lists.iter().flat_map(fan));
        }
        _ => {
            // Every other triangle of a strip turns the other way.
            let strip = |l: &Vec<[f64; 3]>| -> Vec<Triangle> {
                let turn = |(k, w): (usize, &[[f64; 3]])| [w[k % 2], w[1 - k % 2], w[2]];
                l.windows(3).enumerate().map(turn).collect()
            };
            out.extend(lists.iter().flat_map(strip));
        }
    }
    Ok(())
}

/// Corners of a `<vertices>`, or of the source itself.
fn positions<'a>(vertices: Node<'a, 'a>, ids: &Ids<'a>) -> Result<Vec<[f64; 3]>, String> {
    let position = vertices.children().find(|n| n.attribute("semantic") == Some("POSITION"));
    let source = position.map_or(Ok(vertices), |p| referred(ids, p, "source"))?;
    let accessor = source.descendants().find(|n| n.has_tag_name("accessor"));
    let array = match accessor.filter(|a| a.attribute("source").is_some()) {
        Some(accessor) => Some(referred(ids, accessor, "source")?),
        None => child(source, "float_array"),
    };
    let array = array.filter(|a| a.has_tag_name("float_array"));
    let array = array.ok_or_else(|| wrong(source, "has no <float_array> of positions"))?;
    let number = |name: &str, silent: usize| {
        accessor.and_then(|a| a.attribute(name)).and_then(|v| v.parse().ok()).unwrap_or(silent)
    };
    let (offset, stride, numbers) = (number("offset", 0), number("stride", 3), list::<f64>(array)?);
    if stride < 3 {
        return Err(wrong(source, "its positions have fewer than three numbers"));
    }
    let from = numbers.get(offset..).unwrap_or_default();
    Ok(from.chunks(stride).filter(|c| c.len() >= 3).map(|c| [c[0], c[1], c[2]]).collect())
}

/// Cuts a plane polygon into triangles, ear by ear, so that hollow corners stay empty (Meisters 1975).
fn cut(polygon: &[[f64; 3]], out: &mut Vec<Triangle>) {
    let mut left: Vec<Vector3<f64>> = polygon.iter().map(|p| Vector3::from(*p)).collect();
    // Newell's normal.
    let next = |k: usize, n: usize| (k + 1) % n;
    let normal: Vector3<f64> = (0..left.len()).map(|k| left[k].cross(&left[next(k, left.len())])).sum();
    while left.len() > 3 {
        let n = left.len();
        let turns =
            |a: usize, b: usize, c: usize| (left[b] - left[a]).cross(&(left[c] - left[a])).dot(&normal);
        let ear = |b: &usize| {
            let (a, c) = ((b + n - 1) % n, next(*b, n));
            let inside = |p: usize| turns(a, *b, p) >= 0.0 && turns(*b, c, p) >= 0.0 && turns(c, a, p) >= 0.0;
            turns(a, *b, c) > 0.0 && !(0..n).filter(|p| ![a, *b, c].contains(p)).any(inside)
        };
        // One always is, but for rounding and for polygons that cross themselves.
        let b = (0..n).find(ear).unwrap_or(0);
        out.push([left[(b + n - 1) % n], left[b], left[next(b, n)]].map(Into::into));
        left.remove(b);
    }
    if let [a, b, c] = left[..] {
        out.push([a, b, c].map(Into::into));
    }
}
