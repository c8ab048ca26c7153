#include "services/results/report/paper_table.h"

namespace weft {

void AddPaperTable(google::protobuf::RepeatedPtrField<v1::PaperMethod>& table) {
  const auto add = [&table](const char* method, double drift_mm_s, double distortion_mm) {
    v1::PaperMethod& added = *table.Add();
    added.set_method(method);
    added.set_drift_mm_s(drift_mm_s);
    added.set_geodesic_distortion_mm(distortion_mm);
  };
  add("Halimi et al. 2022, pattern registration", 1.50, 9.27);
  add("Halimi et al. 2022, pattern registration, big pattern (4 mm)", 0.77, 9.98);
  add("Body tracking + non-rigid ICP (Pons-Moll et al. 2017)", 72.3, 25.94);
  add("Body tracking + non-rigid ICP + IR optimization (Xiang et al. 2021)", 64.6, 35.49);
}

}  // namespace weft
