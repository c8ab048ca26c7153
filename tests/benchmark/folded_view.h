// A view as cameras have of worn cloth: soft, lit from all sides, deep folds that hide each other.
#pragma once

#include "tests/benchmark/decode_score.h"

namespace weft::testing {

// A curtain of 210 x 400 cells of 2.7 mm around half a body before one camera, 1.4 megapixels. Its folds
// follow a closed form, so it takes seconds, and no cloth is simulated. About 27,000 cells are to be found.
// Nine in ten of them have 4.1 to 8.5 px (median 5.8), half are turned by more than 49 degrees.
// Deterministic.
TrueTake MakeFoldedView();

}  // namespace weft::testing
