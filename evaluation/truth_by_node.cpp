#include "evaluation/truth_by_node.h"

#include <limits>
#include <map>

#include "absl/strings/str_cat.h"

namespace weft {
namespace {

BoardNode NodeOf(const VertexNode& node) { return {node.row, node.col, node.kind}; }

bool SameNode(const VertexNode& a, const VertexNode& b) {
  return a.row == b.row && a.col == b.col && a.kind == b.kind;
}

}  // namespace

bool HaveSameFaces(const GarmentMesh& a, const GarmentMesh& b) {
  return a.rest.vertices_mm.size() == b.rest.vertices_mm.size() && a.rest.faces == b.rest.faces;
}

bool HaveSameVertices(const Template& a, const Template& b) {
  if (a.rest.faces != b.rest.faces || a.node_of_vertex.size() != b.node_of_vertex.size()) return false;
  for (size_t v = 0; v < a.node_of_vertex.size(); ++v)
    if (!SameNode(a.node_of_vertex[v], b.node_of_vertex[v])) return false;
  return true;
}

absl::StatusOr<TruthByNode> TruthByNode::Build(const Template& of_result, const Template& of_truth) {
  if (of_result.board_hash != of_truth.board_hash) {
    return absl::FailedPreconditionError(absl::StrCat("the result's template was sewn from board ",
                                                      of_result.board_hash, ", that of the truth from board ",
                                                      of_truth.board_hash));
  }
  std::map<BoardNode, int> vertex_of;
  for (size_t v = 0; v < of_truth.node_of_vertex.size(); ++v)
    if (of_truth.node_of_vertex[v].row >= 0)
      vertex_of[NodeOf(of_truth.node_of_vertex[v])] = static_cast<int>(v);
  const PrintLocator print(PrintFromVertexNodes(of_truth.rest.faces, of_truth.node_of_vertex));
  TruthByNode out;
  out.nodes_ = of_result.node_of_vertex;
  out.faces_ = of_truth.rest.faces;
  out.vertex_.assign(out.nodes_.size(), -1);
  out.place_.resize(out.nodes_.size());
  for (size_t v = 0; v < out.nodes_.size(); ++v) {
    if (out.nodes_[v].row < 0) continue;
    if (const auto at = vertex_of.find(NodeOf(out.nodes_[v])); at != vertex_of.end()) {
      out.vertex_[v] = at->second;
    } else {
      out.place_[v] = print.Find(out.nodes_[v].PlaceInCells());
    }
    out.matched_ += out.vertex_[v] >= 0 || out.place_[v] ? 1 : 0;
  }
  if (out.matched_ == 0) {
    return absl::FailedPreconditionError(
        "the result's template and that of the truth have no cell of the board in common");
  }
  return out;
}

std::vector<Eigen::Vector3d> TruthByNode::Positions(const std::vector<Eigen::Vector3d>& true_mm) const {
  std::vector<Eigen::Vector3d> positions_mm(
      nodes_.size(), Eigen::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN()));
  for (size_t v = 0; v < nodes_.size(); ++v) {
    if (vertex_[v] >= 0) {
      positions_mm[v] = true_mm[vertex_[v]];
    } else if (place_[v]) {
      positions_mm[v] = PositionOf(*place_[v], true_mm, faces_);
    }
  }
  return positions_mm;
}

std::vector<int> TruthByNode::ScoreableViews(const FrameTruth& truth) const {
  std::map<BoardNode, int> views_of;
  for (const ViewTruth& view : truth.views)
    for (const NodeTruth& node : view.nodes) views_of[node.node] += node.scoreable ? 1 : 0;
  std::vector<int> views(nodes_.size(), 0);
  for (size_t v = 0; v < nodes_.size(); ++v) {
    const auto at = nodes_[v].row >= 0 ? views_of.find(NodeOf(nodes_[v])) : views_of.end();
    if (at != views_of.end()) views[v] = at->second;
  }
  return views;
}

}  // namespace weft
