#include "services/results/report/frame_pictures.h"

#include <algorithm>
#include <optional>

#include "absl/strings/str_cat.h"
#include "base/status_macros.h"
#include "capture/image/image_encoders.h"
#include "services/results/report/mesh_colors.h"

namespace weft {
namespace {

const Eigen::Vector3d kUp(0, -1, 0);

ScalarRange CommonSigmaRange(const std::vector<PicturedMesh>& meshes) {
  std::vector<double> sigmas;
  for (const PicturedMesh& pictured : meshes) {
    const RegisteredMesh& mesh = pictured.mesh;
    for (size_t v = 0; v < mesh.sigma_mm.size() && v < mesh.state.size(); ++v) {
      if (mesh.state[v] == VertexState::kObserved || mesh.state[v] == VertexState::kDriven)
        sigmas.push_back(mesh.sigma_mm[v]);
    }
  }
  return RoundRange(std::move(sigmas));
}

struct Sides {
  Viewpoint front, back;
};

absl::StatusOr<Sides> SidesOf(const std::vector<Eigen::Vector3d>& vertices_mm) {
  WEFT_ASSIGN_OR_RETURN(const Viewpoint front, ViewpointOf(vertices_mm, MeshSide::kFront, kUp));
  WEFT_ASSIGN_OR_RETURN(const Viewpoint back, ViewpointOf(vertices_mm, MeshSide::kBack, kUp));
  return Sides{front, back};
}

// As tall as the mesh asks for at full width, so that wide garments leave no empty paper.
MeshViewOptions SizeFor(const std::vector<Eigen::Vector3d>& vertices_mm, const Viewpoint& front) {
  constexpr double kSlack = 1.06;  // other frames differ a little
  double left = 0, right = 0, low = 0, high = 0;
  for (size_t v = 0; v < vertices_mm.size(); ++v) {
    const double x = vertices_mm[v].dot(front.right), y = vertices_mm[v].dot(front.up);
    left = v == 0 ? x : std::min(left, x);
    right = v == 0 ? x : std::max(right, x);
    low = v == 0 ? y : std::min(low, y);
    high = v == 0 ? y : std::max(high, y);
  }
  MeshViewOptions options;
  if (right > left) {
    const double height_px = options.width_px * kSlack * (high - low) / (right - left);
    options.height_px = static_cast<int>(std::clamp(height_px, 200.0, 620.0));
  }
  return options;
}

// Colours that change from vertex to vertex take most of a MB as PNG, and a page has thirty pictures. JPEG
// has no transparency, so those are on white.
absl::StatusOr<MeshPicture> EncodePicture(const std::string& title, const MeshView& view) {
  constexpr size_t kMostPngBytes = 300'000;
  constexpr int kJpegQuality = 85;
  WEFT_ASSIGN_OR_RETURN(std::string png, EncodePng(view));
  if (png.size() <= kMostPngBytes)
    return MeshPicture{title, std::move(png), view.width_px, view.height_px, "image/png"};
  std::vector<uint8_t> rgb;
  rgb.reserve(view.rgba.size() / 4 * 3);
  for (size_t at = 0; at + 3 < view.rgba.size(); at += 4)
    for (size_t channel = 0; channel < 3; ++channel) {
      const int opacity = view.rgba[at + 3];
      rgb.push_back(static_cast<uint8_t>((view.rgba[at + channel] * opacity + 255 * (255 - opacity)) / 255));
    }
  WEFT_ASSIGN_OR_RETURN(const auto jpeg,
                        EncodeJpeg({view.width_px, view.height_px, 3, 8, rgb}, kJpegQuality));
  return MeshPicture{title, std::string(jpeg.begin(), jpeg.end()), view.width_px, view.height_px,
                     "image/jpeg"};
}

absl::StatusOr<std::vector<MeshPicture>> DrawSides(const TriangleMesh& mesh,
                                                   const std::vector<Eigen::Vector3f>& colors,
                                                   const Sides& sides, MeshViewOptions options,
                                                   double shading) {
  options.shading = shading;
  std::vector<MeshPicture> pictures;
  for (const auto& [title, viewpoint] : {std::pair{"Front", sides.front}, {"Back", sides.back}}) {
    WEFT_ASSIGN_OR_RETURN(const MeshView view, RenderMesh(mesh, colors, viewpoint, options));
    WEFT_ASSIGN_OR_RETURN(MeshPicture picture, EncodePicture(title, view));
    pictures.push_back(std::move(picture));
  }
  return pictures;
}

absl::StatusOr<FramePictures> DrawFrame(const PicturedMesh& pictured, const Sides& sides,
                                        const MeshViewOptions& size, const ScalarRange& range) {
  const TriangleMesh mesh{pictured.mesh.vertices_mm, pictured.faces};
  FramePictures result{pictured.frame, pictured.why_shown, {}, {}, range, {}, false};
  WEFT_ASSIGN_OR_RETURN(auto by_state, DrawSides(mesh, StateColors(pictured.mesh.state), sides, size, 1.0));
  const std::vector<double> sigmas(pictured.mesh.sigma_mm.begin(), pictured.mesh.sigma_mm.end());
  WEFT_ASSIGN_OR_RETURN(auto by_sigma, DrawSides(mesh, ScalarColors(sigmas, range), sides, size, 0.6));
  result.by_state = std::move(by_state);
  result.is_driven = std::ranges::count(pictured.mesh.state, VertexState::kDriven) > 0;
  result.by_sigma = std::move(by_sigma);
  return result;
}

}  // namespace

absl::StatusOr<std::vector<MeshPicture>> DrawBothSides(const TriangleMesh& mesh,
                                                       const std::vector<Eigen::Vector3f>& colors,
                                                       double shading) {
  WEFT_ASSIGN_OR_RETURN(const Sides sides, SidesOf(mesh.vertices_mm));
  return DrawSides(mesh, colors, sides, SizeFor(mesh.vertices_mm, sides.front), shading);
}

std::vector<FramePictures> DrawFrames(const std::vector<PicturedMesh>& meshes,
                                      std::vector<std::string>& notes) {
  const ScalarRange range = CommonSigmaRange(meshes);
  std::optional<Sides> sides;
  MeshViewOptions size;
  std::vector<FramePictures> pictures;
  for (const PicturedMesh& pictured : meshes) {
    const auto note = [&](const absl::Status& status) {
      notes.push_back(absl::StrCat("Frame ", pictured.frame, " has no picture: ", status.message()));
    };
    if (!sides) {
      const absl::StatusOr<Sides> found = SidesOf(pictured.mesh.vertices_mm);
      if (!found.ok()) {
        note(found.status());
        continue;
      }
      sides = *found;
      size = SizeFor(pictured.mesh.vertices_mm, sides->front);
    }
    absl::StatusOr<FramePictures> drawn = DrawFrame(pictured, *sides, size, range);
    if (drawn.ok()) {
      pictures.push_back(*std::move(drawn));
    } else {
      note(drawn.status());
    }
  }
  return pictures;
}

}  // namespace weft
