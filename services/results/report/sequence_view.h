// A sequence of meshes that a page shows in three dimensions, by itself and without a network.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "services/results/report/decimated_mesh.h"
#include "services/results/report/html_report.h"
#include "services/results/report/mesh_colors.h"
#include "services/results/report/mesh_view.h"
#include "services/results/report/report_sections.h"
#include "weft/v1/page.pb.h"

namespace weft {

// How vertices may be coloured: a byte per vertex and frame, and what the bytes look like.
struct SequenceColoring {
  std::string name;  // "sigma"
  v1::PageKey key;
  std::array<Eigen::Vector3f, 256> palette;
  bool is_first_shown = false;  // else the first one is
};
// VertexState as a byte.
SequenceColoring ColoringByState();
// Values by PaletteIndex; `label` and `unit` as in ColorBar.
SequenceColoring ColoringByValue(const std::string& name, const std::string& label, const std::string& unit,
                                 const ScalarRange& range);
// 255 where the value is not a number, else the 255 steps of the range.
uint8_t PaletteIndex(double value, const ScalarRange& range);

// One frame of it.
struct SequenceFrame {
  std::string name;
  std::string note;                               // "bridged"; may be empty
  std::vector<Eigen::Vector3f> vertices_mm;       // [kept]
  std::vector<std::vector<uint8_t>> color_bytes;  // [colorings][kept]
};

// A garment of a joint template: consecutive faces of the decimated mesh.
struct SequencePart {
  std::string name;
  size_t faces = 0;
};

// Collects frames as they are read; what it keeps is what the page will hold.
class SequenceView {
 public:
  // At least one colouring. `viewpoint` is where the view begins. `fps`: of the take; 0: not known.
  SequenceView(DecimatedMesh mesh, std::vector<SequenceColoring> colorings, const Viewpoint& viewpoint,
               double fps);

  // Parts that may be shown alone; together they have all faces, in their order.
  void SetParts(std::vector<SequencePart> parts) { parts_ = std::move(parts); }

  // Positions become 16 bits wide: their error is at most 1/131070 of the frame's longest side.
  void Add(const SequenceFrame& frame);

  // Where each kept vertex is in the full mesh.
  const std::vector<int>& kept() const { return mesh_.vertices; }
  size_t frames() const { return frames_; }

  // What the page will hold, but for the still picture.
  v1::PageSequence Take() &&;

  // The section of the page. `still` stands for the view on paper and where there is no WebGL. `about` (HTML)
  // says what was left out. Empty without frames.
  std::string Section(const MeshPicture& still, const std::string& about) const;
  // The elements that the program of the page reads: faces and frames.
  std::string Data() const;

 private:
  std::string FaceBytes() const;

  DecimatedMesh mesh_;
  std::vector<SequenceColoring> colorings_;
  Viewpoint viewpoint_;
  double fps_;
  std::vector<SequencePart> parts_;
  size_t frames_ = 0;
  v1::PageSequence page_;
};

// The program of a page with its section.
PageProgram SequenceProgram(const SequenceView& sequence);

// Kept vertices of each frame so that a page of all frames stays below 30 MB and opens at once; at most
// 16,000, since more are not seen on a screen.
size_t SequenceVertices(size_t frames, size_t colorings);
// Which of a sequence's frames are shown: all up to 300, else 300 spread evenly, first and last among them.
std::vector<size_t> SequenceFrames(size_t frames);

}  // namespace weft
