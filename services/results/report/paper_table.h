// The figures of the paper beside ours: Halimi et al. 2022, Table 1 and Figure 7.
#pragma once

#include <limits>
#include <string>
#include <vector>

#include "weft/v1/evaluation.pb.h"

namespace weft {

// Table 1.
struct PublishedScore {
  const char* method;
  double drift_mm_s;
  double geodesic_distortion_mm;
};
const std::vector<PublishedScore>& PaperTable1();

// Ours; NaN where it was not measured. Coverage from 0 to 1, over the frames.
struct PaperFigures {
  double drift_mm_s = std::numeric_limits<double>::quiet_NaN();
  double geodesic_distortion_mm = std::numeric_limits<double>::quiet_NaN();
  double coverage = std::numeric_limits<double>::quiet_NaN();
  double lowest_coverage = std::numeric_limits<double>::quiet_NaN();
  double highest_coverage = std::numeric_limits<double>::quiet_NaN();
};
// As data of a page.
void AddPaperTable(google::protobuf::RepeatedPtrField<v1::PaperMethod>& table);
// The section of a page; says how to measure what is missing.
std::string PaperSection(const PaperFigures& ours);

}  // namespace weft
