//! Directed graphs of numbered nodes: their strongly connected components, and how deep a node lies.

use std::collections::BTreeSet;

/// Number of the component of each node; nodes that reach each other have the same.
pub fn components(count: usize, edges: &[[usize; 2]]) -> Vec<usize> {
    let next = Adjacent::new(count, edges.iter().copied());
    let before = Adjacent::new(count, edges.iter().map(|[a, b]| [*b, *a]));
    // Kosaraju: the nodes in the order in which a search is done with them, backwards, each with all that reach it
    let (mut seen, mut done) = (vec![false; count], Vec::with_capacity(count));
    for start in 0..count {
        next.visit(start, &mut seen, |node| done.push(node));
    }
    let (mut seen, mut component) = (vec![false; count], vec![0; count]);
    for (number, start) in done.into_iter().rev().enumerate() {
        before.visit(start, &mut seen, |node| component[node] = number);
    }
    component
}

/// Whether each node comes back to itself: an edge lies inside its component.
pub fn in_loops(component: &[usize], edges: &[[usize; 2]]) -> Vec<bool> {
    let inner: BTreeSet<usize> =
        edges.iter().filter(|[a, b]| component[*a] == component[*b]).map(|[a, _]| component[*a]).collect();
    component.iter().map(|own| inner.contains(own)).collect()
}

/// Length of the longest path of edges to each node of a graph without loops.
pub fn levels(count: usize, edges: &[[usize; 2]]) -> Vec<usize> {
    let mut level = vec![0; count];
    // the longest path has fewer edges than there are nodes
    for _ in 0..count {
        let mut changed = false;
        for [from, to] in edges {
            changed |= level[*to] <= level[*from];
            level[*to] = level[*to].max(level[*from] + 1);
        }
        if !changed {
            break;
        }
    }
    level
}

/// Nodes that are reached from some, these included.
pub fn reached(count: usize, edges: &[[usize; 2]], from: impl Iterator<Item = usize>) -> Vec<bool> {
    let next = Adjacent::new(count, edges.iter().copied());
    let mut seen = vec![false; count];
    from.for_each(|node| next.visit(node, &mut seen, |_| {}));
    seen
}

/// Nodes behind each node.
struct Adjacent {
    /// Where those of a node begin; one more at the end.
    first: Vec<usize>,
    nodes: Vec<usize>,
}

impl Adjacent {
    fn new(count: usize, edges: impl Iterator<Item = [usize; 2]> + Clone) -> Self {
        let mut first = vec![0; count + 1];
        edges.clone().for_each(|[from, _]| first[from + 1] += 1);
        for node in 0..count {
            first[node + 1] += first[node];
        }
        let (mut place, mut nodes) = (first.clone(), vec![0; first[count]]);
        for [from, to] in edges {
            nodes[place[from]] = to;
            place[from] += 1;
        }
        Self { first, nodes }
    }

    /// Calls `done` with each node that is reached from one and was not seen, after those behind it.
    fn visit(&self, start: usize, seen: &mut [bool], mut done: impl FnMut(usize)) {
        if std::mem::replace(&mut seen[start], true) {
            return;
        }
        let mut open = vec![(start, self.first[start])];
        while let Some((node, at)) = open.last_mut() {
            if *at == self.first[*node + 1] {
                done(*node);
                open.pop();
                continue;
            }
            let to = self.nodes[*at];
            *at += 1;
            if !std::mem::replace(&mut seen[to], true) {
                open.push((to, self.first[to]));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{components, in_loops, levels, reached};

    #[test]
    fn loops_are_components_and_chains_are_not() {
        let edges = [[0, 1], [1, 2], [2, 0], [2, 3], [3, 4], [4, 4]];
        let c = components(6, &edges);
        assert!(c[0] == c[1] && c[1] == c[2]);
        assert!(c[3] != c[2] && c[3] != c[4] && c[5] != c[0]);
        assert_eq!(in_loops(&c, &edges), [true, true, true, false, true, false]);
        assert_eq!(reached(6, &edges, [3].into_iter()), [false, false, false, true, true, false]);
    }

    #[test]
    fn the_longest_path_is_the_level() {
        assert_eq!(levels(4, &[[3, 1], [1, 0], [3, 0]]), [2, 1, 0, 0]);
        assert_eq!(levels(2, &[]), [0, 0]);
    }
}
