// observations.csv: what decoding found, one line per node of a view.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "absl/status/statusor.h"
#include "pattern/observation.h"

namespace weft {

// The observations of one image. `image` is its file name without folder and ending: in a dump, the camera.
struct ImageObservations {
  std::string image;
  std::vector<Observation> observations;
};

// Columns image,x_px,y_px,board_row,board_col,kind,confidence,sigma_px with kind `center` or `corner`;
// positions to 1e-4 px, sigmas to 1e-5 px.
std::string ObservationsToCsv(const std::vector<ImageObservations>& images);
// The same in two steps: the lines of each image can be made where it was decoded.
std::string ObservationLines(const ImageObservations& image);
std::string ObservationsCsv(const std::vector<std::string>& lines_of_images);
absl::Status WriteObservations(const std::string& path, const std::vector<ImageObservations>& images);

// Reads them back, images in the order of their first line. Files up to version 0.1.2 lack the last column;
// sigma_px stays 0, unknown. InvalidArgument names source_name and line.
absl::StatusOr<std::vector<ImageObservations>> ParseObservations(std::string_view csv,
                                                                 const std::string& source_name);
absl::StatusOr<std::vector<ImageObservations>> ReadObservations(const std::string& path);

}  // namespace weft
