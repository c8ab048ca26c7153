// A sequence of meshes that a page shows in three dimensions, by itself and without a network.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "alignment/decimation/decimated_mesh.h"
#include "services/results/report/mesh_colors.h"
#include "services/results/report/mesh_view.h"
#include "weft/v1/page.pb.h"

namespace weft {

// How vertices may be coloured: by a byte per vertex and frame, which is VertexState.
v1::PageSequence::Coloring ColoringByState();
// Values by PaletteIndex; `label` and `unit` as in ScaleKey.
v1::PageSequence::Coloring ColoringByValue(const std::string& name, const std::string& label,
                                           const std::string& unit, const ScalarRange& range);
// 255 where the value is not a number, else the 255 steps of the range.
uint8_t PaletteIndex(double value, const ScalarRange& range);

// Without frames, colourings and parts. `viewpoint` is where the view begins.
v1::PageSequence BeginSequence(const DecimatedMesh& mesh, const Viewpoint& viewpoint);

struct SequenceFrame {
  std::string name;
  std::string note;                               // "bridged"; may be empty
  std::vector<Eigen::Vector3f> vertices_mm;       // of the decimated mesh
  std::vector<std::vector<uint8_t>> color_bytes;  // [colorings][vertices]
};
// Positions become 16 bits wide: their error is at most 1/131070 of the frame's longest side.
void AddFrame(const SequenceFrame& frame, v1::PageSequence& sequence);

// Kept vertices of each frame so that a page of all frames stays below 30 MB and opens at once; at most
// 16,000, since more are not seen on a screen.
size_t SequenceVertices(size_t frames, size_t colorings);
// Which of a sequence's frames are shown: all up to 300, else 300 spread evenly, first and last among them.
std::vector<size_t> SequenceFrames(size_t frames);

}  // namespace weft
