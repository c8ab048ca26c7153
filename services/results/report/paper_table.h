// The figures of the paper: Halimi et al. 2022, Table 1.
#pragma once

#include "weft/v1/evaluation.pb.h"

namespace weft {

void AddPaperTable(google::protobuf::RepeatedPtrField<v1::PaperMethod>& table);

}  // namespace weft
