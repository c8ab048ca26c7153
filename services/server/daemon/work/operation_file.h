// How an operation is kept. Only for the source files of OperationQueue.
#pragma once

#include <string>

#include "weft/v1/operations.pb.h"

namespace weft {

inline std::string OperationFile(const std::string& folder) { return folder + "/operation.json"; }

// Leaves out what may be long: an answer of GetOperation may have a MiB of each, a list has many.
inline void KeepShort(v1::Operation& operation) {
  operation.clear_output();
  operation.mutable_spec()->clear_inputs();
  operation.mutable_spec()->clear_options();
}

}  // namespace weft
