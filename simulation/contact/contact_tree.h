#pragma once

#include <vector>

#include "simulation/contact/tree_math.h"

namespace atelier {

/// Tree over the boxes of moving primitives: built once from where they are, refitted when they
/// move (a surface keeps its neighbours). The CUDA twin builds and refits the same tree.
template <class T>
struct ContactTree {
  std::vector<BoxNode<T>> nodes;  ///< nodes[0] is the root; at least one where there are boxes
  std::vector<TreeParent> node_parent;
  std::vector<TreeParent> leaf_parent;  ///< of each primitive
  std::vector<int> bottom_up;           ///< nodes, children before parents
};

/// Builds the tree. Cost: O(n log n).
template <class T>
ContactTree<T> build_contact_tree(const std::vector<Box<T>>& boxes);

/// Takes new boxes over, same count. Cost: O(n).
template <class T>
void refit_contact_tree(ContactTree<T>& tree, const std::vector<Box<T>>& boxes);

extern template ContactTree<float> build_contact_tree(const std::vector<Box<float>>&);
extern template ContactTree<double> build_contact_tree(const std::vector<Box<double>>&);
extern template void refit_contact_tree(ContactTree<float>&, const std::vector<Box<float>>&);
extern template void refit_contact_tree(ContactTree<double>&, const std::vector<Box<double>>&);

}  // namespace atelier
