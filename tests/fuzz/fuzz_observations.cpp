#include <cmath>

#include "services/formats/files/observations_file.h"
#include "tests/fuzz/fuzz_target.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  const auto images = weft::ParseObservations({reinterpret_cast<const char*>(data), size}, "csv");
  if (!images.ok()) return 0;
  size_t rows = 0;
  for (const weft::ImageObservations& image : *images) {
    rows += image.observations.size();
    for (const weft::Observation& o : image.observations) {
      weft::FuzzRequire(std::isfinite(o.x_px) && std::isfinite(o.y_px));
      weft::FuzzRequire(o.node.row >= 0 && o.node.col >= 0 && o.confidence >= 0 && o.confidence <= 1);
    }
  }
  const auto again = weft::ParseObservations(weft::ObservationsToCsv(*images), "again");
  weft::FuzzRequire(again.ok() && again->size() == images->size());
  size_t rows_again = 0;
  for (const weft::ImageObservations& image : *again) rows_again += image.observations.size();
  weft::FuzzRequire(rows_again == rows);
  return 0;
}

std::vector<std::string> weft::FuzzSeeds() {
  return {
      "image,x_px,y_px,board_row,board_col,kind,confidence\ncam1,1.2500,-0.5000,3,4,center,0.50000\n"
      "\"a, \"\"b\"\"\",10.0,2.0,0,0,corner,1\ncam1,3,4,5,6,center,0\n"};
}
