// Correspondence drift from pictures alone (paper, section 7.1.3): optical flow between the textures that a
// registered sequence makes of its pictures.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "alignment/template.h"
#include "capture/image/frame.h"
#include "capture/rig/camera_model.h"
#include "capture/rig/rig.h"
#include "evaluation/vertex_views.h"
#include "simulation/printed_mesh.h"

namespace weft {

struct TextureDriftOptions {
  int texels_per_cell = 12;
  int block_cells = 24;           // the board is unwrapped in square blocks of this size ...
  int margin_cells = 4;           // ... with so much around, for the windows of the flow
  int views_per_block = 3;        // cameras that colour a block, at most
  double window_cells = 3;        // size of the flow's window
  double max_return_cells = 0.1;  // flow there and back must end this near to where it began
  ViewingOptions viewing;

  absl::Status Validate() const;
};

// Brightness of a picture, [height][width].
struct GreyImage {
  int width_px = 0, height_px = 0;
  std::vector<float> value;
};
absl::StatusOr<GreyImage> ToGrey(const Frame& frame);

// Which camera is to colour which blocks in two consecutive frames.
struct UnwrapPlan {
  struct BlockView {
    int block = 0;
    int rank = 0;  // 0: the camera that sees most of the block best
  };
  std::vector<std::vector<BlockView>> of_camera;  // [cameras]
  std::vector<std::vector<bool>> seen;            // [cameras][vertices], in both frames; empty without blocks
};

// Drift of the vertices between two frames; starts without any measurement.
struct TextureDriftField {
  std::vector<double> mm;  // [vertices], length of the displacement over the cloth at rest; NaN: not measured
  std::vector<int8_t> rank;  // [vertices], of the view that measured it
  int64_t tried = 0;         // windows whose texels were all seen
  int64_t lost = 0;          // of them, those where the flow did not come back to its start
};

// The board's plane is the texture's domain: a vertex with a cell lies at its cell's centre. A texel takes
// its colour from the same camera in both frames, so that colours and parallax between cameras do not look
// like motion. A window of the flow never crosses from one camera's pixels to another's. Flow by pyramidal
// Lucas-Kanade (OpenCV) at the cell centres, over textures normalised by local mean and contrast. Texels
// become mm by the metric of the template at rest. Immutable; any number of threads may use one at once.
class TextureDrift {
 public:
  // InvalidArgument: options, a template without printed faces.
  static absl::StatusOr<TextureDrift> Build(const Template& garment, const TextureDriftOptions& options);

  // Meshes have the template's vertices and faces. `uncovered`, [cameras][vertices]: where nothing else is in
  // front of the cloth in either frame (ReadAround); empty, of all cameras or of one: not known, taken as
  // everywhere. Parallel in the calling thread's TBB arena.
  UnwrapPlan Plan(const Rig& rig, const VisibleMesh& before, const VisibleMesh& after,
                  const std::vector<std::vector<bool>>& uncovered) const;

  TextureDriftField EmptyField() const;
  // Adds what camera `camera` measures by its blocks of the plan. The same numbers in any order of the
  // cameras and at any thread count; parallel over the blocks in the calling thread's TBB arena.
  void Measure(const UnwrapPlan& plan, int camera, const CameraModel& model,
               const std::vector<Eigen::Vector3d>& before_mm, const GreyImage& before,
               const std::vector<Eigen::Vector3d>& after_mm, const GreyImage& after,
               TextureDriftField* field) const;

  // The texture of a whole frame as it would be coloured by one camera, [rows * t][cols * t] texels of the
  // board's printed part; NaN where the camera sees nothing. For looking at.
  GreyImage Unwrap(const CameraModel& model, const std::vector<Eigen::Vector3d>& vertices_mm,
                   const std::vector<bool>& seen, const GreyImage& image) const;

 private:
  struct Block {
    int row_begin = 0, row_end = 0, col_begin = 0, col_end = 0;  // board cells, without the margin
    std::vector<int> vertices;                                   // with a cell in the block
  };
  struct Texture;
  struct FlowCount {
    int64_t tried = 0, lost = 0;
  };

  explicit TextureDrift(PrintLocator locator) : locator_(std::move(locator)) {}
  Texture Colour(int row_begin, int row_end, int col_begin, int col_end, const CameraModel& model,
                 const std::vector<Eigen::Vector3d>& vertices_mm, const std::vector<bool>& seen,
                 const GreyImage& image) const;
  FlowCount MeasureBlock(const Block& block, int rank, const Texture& before, const Texture& after,
                         TextureDriftField* field) const;

  TextureDriftOptions options_;
  PrintLocator locator_;
  std::vector<Face> faces_;
  std::vector<VertexNode> nodes_;
  std::vector<Eigen::Matrix<double, 3, 2>> mm_per_cell_;  // [vertices], rest position by column and row
  std::vector<Block> blocks_;
};

}  // namespace weft
