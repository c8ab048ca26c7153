// How a thread of ours makes room for others.
#pragma once

namespace weft {

// Lets the calling thread run at this niceness (0 to 19), as Linux has it for each thread alone. Where the
// kernel refuses that, the thread goes on as it is.
void YieldToOthers(int niceness);

}  // namespace weft
