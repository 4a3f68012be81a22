// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/occupancy/occupancy_map.hpp"

#include <octomap/OcTree.h>

#include <algorithm>
#include <cmath>
#include <exception>
#include <sstream>

#include "roslam/common/error.hpp"
#include "roslam/common/out_of_memory.hpp"
#include "roslam/common/write_file.hpp"
#include "roslam/dense/dense_mapper.hpp"
#include "roslam/dense/depth_keyframe.hpp"
#include "roslam/occupancy/cell_set.hpp"
#include "roslam/occupancy/occupancy_file.hpp"
#include "roslam/occupancy/ray_carving.hpp"

namespace roslam {

namespace {
using octomap::OcTree;
using octomap::OcTreeKey;
using Node = octomap::OcTreeNode;

constexpr unsigned kDepth = 16;  // of the smallest cells in an octree of OctoMap

OcTreeKey key_of(const Eigen::Vector3i& cell) {
  const Eigen::Matrix<octomap::key_type, 3, 1> key = (cell.array() + kFarthestCell).cast<octomap::key_type>();
  return {key[0], key[1], key[2]};
}

// The part of a cube that is in a region.
enum class Share { kNone, kSome, kAll };

// The marked cells of a block.
class BlockRegion {
 public:
  BlockRegion(const BlockKey& key, const CellBlock& marks)
      : corner_(kBlockSide * key.x, kBlockSide * key.y, kBlockSide * key.z), marks_(marks) {}

  Share of_cube(const Eigen::Vector3i& corner, int side) const {
    if (side > kBlockSide) {
      const Eigen::Array3i within = (corner_ - corner).array();
      return (within >= 0).all() && (within < side).all() ? Share::kSome : Share::kNone;
    }
    const Eigen::Array3i within = (corner - corner_).array();
    if ((within < 0).any() || (within >= kBlockSide).any()) return Share::kNone;
    const Eigen::Matrix<std::size_t, 3, 1> at = within.cast<std::size_t>();
    const int count = marks_.count(at[0], at[1], at[2], static_cast<std::size_t>(side));
    return count == 0 ? Share::kNone : count == side * side * side ? Share::kAll : Share::kSome;
  }

 private:
  Eigen::Vector3i corner_;
  const CellBlock& marks_;
};

// The cells of a box, end exclusive.
struct BoxRegion {
  Eigen::Array3i begin, end;

  Share of_cube(const Eigen::Vector3i& corner, int side) const {
    const Eigen::Array3i low = corner.array(), high = low + side;
    if ((high <= begin).any() || (low >= end).any()) return Share::kNone;
    return (low >= begin).all() && (high <= end).all() ? Share::kAll : Share::kSome;
  }
};

// Sets the cells of a region free or occupied and keeps the tree pruned.
template <typename Region>
class RegionWriter {
 public:
  RegionWriter(OcTree& tree, const Region& region, bool is_occupied)
      : tree_(tree),
        region_(region),
        is_occupied_(is_occupied),
        value_(is_occupied ? tree.getClampingThresMaxLog() : tree.getClampingThresMinLog()) {}

  // any_cell: one of the region's cells.
  void write(const Eigen::Vector3i& any_cell) {
    if (tree_.getRoot() == nullptr)
      tree_.setNodeValue(key_of(any_cell), value_, true);  // the only way to create a root
    write(tree_.getRoot(), false, {-kFarthestCell, -kFarthestCell, -kFarthestCell}, 2 * kFarthestCell);
  }

 private:
  // is_new: the node was just created: it has no children, but is unknown, not a leaf with a state.
  void write(Node* node, bool is_new, const Eigen::Vector3i& corner, int side) {
    const bool is_leaf = !is_new && !tree_.nodeHasChildren(node);
    if (is_leaf && (!is_occupied_ || tree_.isNodeOccupied(node))) return;
    if ((is_leaf || is_new) && region_.of_cube(corner, side) == Share::kAll) {
      node->setLogOdds(value_);
      return;
    }
    if (is_leaf) tree_.expandNode(node);
    const int half = side / 2;
    for (int child = 0; child < 8; ++child) {
      const auto index = static_cast<unsigned>(child);
      const Eigen::Vector3i at = corner + half * Eigen::Vector3i(child & 1, child >> 1 & 1, child >> 2 & 1);
      if (region_.of_cube(at, half) == Share::kNone) continue;
      const bool is_missing = !tree_.nodeChildExists(node, index);
      write(is_missing ? tree_.createNodeChild(node, index) : tree_.getNodeChild(node, index), is_missing, at,
            half);
    }
    if (!tree_.pruneNode(node)) node->updateOccupancyChildren();
  }

  OcTree& tree_;
  const Region& region_;
  bool is_occupied_;
  float value_;
};

// The first marked cell of a block, if any is.
bool first_marked(const BlockKey& key, const CellBlock& marks, Eigen::Vector3i& cell) {
  for (int i = 0; i < kBlockVoxels; ++i) {
    const Eigen::Vector3i at(i % kBlockSide, i / kBlockSide % kBlockSide, i / kBlockSide / kBlockSide);
    if (marks.count(static_cast<std::size_t>(at[0]), static_cast<std::size_t>(at[1]),
                    static_cast<std::size_t>(at[2]), 1) == 0)
      continue;
    cell = kBlockSide * Eigen::Vector3i(key.x, key.y, key.z) + at;
    return true;
  }
  return false;
}
}  // namespace

OccupancyMap::OccupancyMap(double resolution) {
  if (!is_occupancy_resolution(resolution))
    throw OptionsError("the occupancy resolution must be 0.001 to 10 metres");
  tree_ = std::make_unique<OcTree>(resolution);
}

OccupancyMap::~OccupancyMap() = default;
OccupancyMap::OccupancyMap(OccupancyMap&&) noexcept = default;
OccupancyMap& OccupancyMap::operator=(OccupancyMap&&) noexcept = default;

void OccupancyMap::set_cells(const BlockKey& key, const CellBlock& marks, bool is_occupied) {
  Eigen::Vector3i first;
  if (!first_marked(key, marks, first)) return;
  const BlockRegion region(key, marks);
  RegionWriter<BlockRegion>(*tree_, region, is_occupied).write(first);
}

void OccupancyMap::add_view(const DepthKeyframe& keyframe, const SE3& T_world_camera) {
  for (const auto& [key, marks] : cells_seen_through(keyframe, T_world_camera, resolution()))
    set_cells(key, marks, false);
}

void OccupancyMap::add_surface(const SurfaceMap& surface) {
  CellSet cells;
  const double scale = 1.0 / resolution();
  for (const SurfacePoint& point : surface.points) {
    Eigen::Vector3i cell;
    if (!find_cell(point.position.cast<double>(), scale, cell)) {
      throw OptionsError("the occupancy resolution is too fine for points this far from the origin; choose " +
                         std::to_string(resolution() * 2.0) + " metres or more");
    }
    mark(cells[block_of(cell)], cell);
  }
  for (const auto& [key, marks] : cells) set_cells(key, marks, true);
}

void OccupancyMap::free_from(const OccupancyMap& other) {
  const double scale = other.resolution() / resolution();
  for (auto leaf = other.tree_->begin_leafs(); leaf != other.tree_->end_leafs(); ++leaf) {
    if (other.tree_->isNodeOccupied(*leaf)) continue;
    const OcTreeKey key = leaf.getIndexKey();
    const int side = 1 << (kDepth - leaf.getDepth());
    BoxRegion box;
    for (unsigned i = 0; i < 3; ++i) {
      // Cells of this map with their centre in the leaf.
      const double low = scale * (static_cast<int>(key[i]) - kFarthestCell), high = low + scale * side;
      const auto first = [](double border) {
        return static_cast<int>(
            std::clamp(std::ceil(border - 0.5), -1.0 * kFarthestCell, 1.0 * kFarthestCell));
      };
      box.begin[i] = first(low);
      box.end[i] = first(high);
    }
    if ((box.begin < box.end).all()) RegionWriter<BoxRegion>(*tree_, box, false).write(box.begin.matrix());
  }
}

OccupancyState OccupancyMap::at(const Eigen::Vector3d& point) const {
  Eigen::Vector3i cell;
  if (!find_cell(point, 1.0 / resolution(), cell)) return OccupancyState::kUnknown;
  const Node* node = tree_->search(key_of(cell));
  if (node == nullptr) return OccupancyState::kUnknown;
  return tree_->isNodeOccupied(node) ? OccupancyState::kOccupied : OccupancyState::kFree;
}

double OccupancyMap::resolution() const { return tree_->getResolution(); }

double OccupancyMap::free_volume() const { return volume(false); }

double OccupancyMap::occupied_volume() const { return volume(true); }

double OccupancyMap::volume(bool is_occupied) const {
  double sum = 0.0;
  for (auto leaf = tree_->begin_leafs(); leaf != tree_->end_leafs(); ++leaf)
    if (tree_->isNodeOccupied(*leaf) == is_occupied) sum += std::pow(leaf.getSize(), 3);
  return sum;
}

void OccupancyMap::write(const std::filesystem::path& file) const {
  const bool has_probabilities = file.extension() == ".ot";
  if (!has_probabilities && file.extension() != ".bt")
    throw OptionsError(file.string() + ": an OctoMap file has to end in .bt or .ot");
  std::ostringstream bytes;
  bytes << occupancy_header(has_probabilities, tree_->size(), resolution());
  if (has_probabilities) {
    tree_->writeData(bytes);
  } else if (tree_->getRoot() != nullptr) {
    tree_->writeBinaryNode(bytes, tree_->getRoot());
  }
  replace_file(file, bytes.view());
}

OccupancyMap OccupancyMap::read(const std::filesystem::path& file) {
  try {
    const OccupancyFile content = read_occupancy_file(file);
    OccupancyMap result(content.resolution);
    OcTree& tree = *result.tree_;
    if (content.nodes.empty()) return result;
    std::istringstream nodes(content.nodes);
    if (content.has_probabilities) {
      tree.readData(nodes);
    } else {
      tree.readBinaryData(nodes);
    }
    tree.updateInnerOccupancy();
    tree.toMaxLikelihood();
    tree.prune();
    return result;
  } catch (const Error&) {
    throw;
  } catch (const std::exception& error) {
    throw_if_out_of_memory(error, file, "give a smaller map");
    throw InputError(file.string() + ": no usable OctoMap file, " + error.what());
  }
}

double usual_resolution(double spacing) {
  constexpr double kLeast = 0.05, kMost = 10.0;  // metres
  return std::clamp(2.0 * spacing, kLeast, kMost);
}

OccupancyMap occupancy_map_of(const DenseMapper& mapper, SubmapId submap, const SurfaceMap& surface,
                              double resolution) {
  OccupancyMap result(resolution != 0.0 ? resolution : usual_resolution(mapper.voxel_size()));
  result.add_surface(surface);  // first, so that no occupied cell is carved
  mapper.visit(submap, [&](const DepthKeyframe& keyframe, const SE3& T_world_camera) {
    result.add_view(keyframe, T_world_camera);
  });
  return result;
}

}  // namespace roslam
