//! The tree of clusters over the facets of a region (model.md §7, "tree"). Its form depends only on
//! the number of facets, so that it is built once a scene; only the nodes' contents change with the
//! frame.

/// Number of children of a node. On a surface in Morton order four are a quadrant each; a cloud's
/// octant takes two levels.
const FAN: u32 = 4;

/// Nodes in depth-first order, parents before their children.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Tree {
    /// Size of each node's subtree, itself included: the offset to the next node outside it. 1 is a
    /// facet.
    pub n_nodes: Vec<u32>,
    /// Node of each facet, in the order of facets.
    pub leaves: Vec<u32>,
    /// Clusters by height. A cluster of `merges[h]` depends only on lower ones.
    pub merges: Vec<Vec<u32>>,
}

impl Tree {
    /// Adds the tree over the next `n` facets and returns its root; there is no node if n is 0.
    pub fn push(&mut self, n: u32) -> u32 {
        let root = self.n_nodes.len() as u32;
        if n > 0 {
            self.push_node(n);
        }
        root
    }

    /// Returns the number of nodes of a tree over `n` facets.
    pub fn n_nodes_over(n: u64) -> u64 {
        if n < 2 {
            return n;
        }
        let run = run_of(n);
        // A full run is a whole tree: 1 + FAN + FAN² + … nodes.
        let full = (u64::from(FAN) * run - 1) / u64::from(FAN - 1);
        1 + n / run * full + Tree::n_nodes_over(n % run)
    }

    /// Adds the next `n` facets without clusters and returns the first one's node.
    pub fn push_flat(&mut self, n: u32) -> u32 {
        let root = self.n_nodes.len() as u32;
        self.leaves.extend(root..root + n);
        self.n_nodes.resize((root + n) as usize, 1);
        root
    }

    /// Adds a subtree and returns its height: 0 for a facet.
    fn push_node(&mut self, n: u32) -> usize {
        let i = self.n_nodes.len();
        self.n_nodes.push(1);
        if n == 1 {
            self.leaves.push(i as u32);
            return 0;
        }
        let run = run_of(n.into()) as u32;
        let mut height = 0;
        for first in (0..n).step_by(run as usize) {
            height = height.max(self.push_node(run.min(n - first)));
        }
        self.n_nodes[i] = (self.n_nodes.len() - i) as u32;
        if self.merges.len() <= height {
            self.merges.resize(height + 1, vec![]);
        }
        self.merges[height].push(i as u32);
        height + 1
    }
}

/// Returns the facets of a child of a node of `n`. All children but the last are full: runs of a
/// power of FAN facets, which the quadrants of a power of two fit.
fn run_of(n: u64) -> u64 {
    let mut run = 1;
    while run < n.div_ceil(FAN.into()) {
        run *= u64::from(FAN);
    }
    run
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_node_stands_before_its_children_and_its_run_holds_them() {
        let mut tree = Tree::default();
        assert_eq!(tree.push(6), 0);
        // 6 facets: a full run of 4 and one of 2.
        assert_eq!(tree.n_nodes, [9, 5, 1, 1, 1, 1, 3, 1, 1]);
        assert_eq!(tree.leaves, [2, 3, 4, 5, 7, 8]);
        assert_eq!(tree.merges, [vec![1, 6], vec![0]]);
        assert_eq!((tree.push(0), tree.push(1)), (9, 9));
        assert_eq!((tree.leaves.len(), tree.n_nodes.len()), (7, 10));
    }

    #[test]
    fn every_place_is_a_leaf_once_and_every_cluster_merges_after_its_children() {
        for n in [2u32, 3, 4, 5, 16, 17, 64, 1000] {
            let mut tree = Tree::default();
            tree.push(n);
            assert_eq!(tree.leaves.len(), n as usize);
            let mut done: Vec<bool> = tree.n_nodes.iter().map(|k| *k == 1).collect();
            for merge in tree.merges.iter().flatten() {
                let i = *merge as usize;
                let mut child = i + 1;
                while child < i + tree.n_nodes[i] as usize {
                    assert!(done[child], "{n}: {child} before {i}");
                    child += tree.n_nodes[child] as usize;
                }
                done[i] = true;
            }
            assert!(done.iter().all(|d| *d) && tree.n_nodes[0] as usize == done.len());
            // Clusters are a third of the facets, plus one partial run at each height.
            assert!(done.len() as u32 <= n + n / 3 + 12, "{n}: {}", done.len());
        }
    }

    #[test]
    fn nodes_are_counted_without_the_tree() {
        // 6 facets: the root, a run of 4 with its cluster, and one of 2 with its own.
        assert_eq!([0, 1, 2, 4, 5, 6].map(Tree::n_nodes_over), [0, 1, 3, 5, 7, 9]);
        for n in (0..300).chain([4096, 4097, 65_535, 90_000, 100_001]) {
            let mut tree = Tree::default();
            tree.push(n);
            assert_eq!(Tree::n_nodes_over(n.into()), tree.n_nodes.len() as u64, "{n}");
        }
    }
}
