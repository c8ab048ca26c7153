// A limit on the size of files (RLIMIT_FSIZE) as an error instead of an end.
#pragma once

namespace weft {

// From now on a write beyond the limit fails with EFBIG, as one to a full disk does, instead of ending this
// process and those that it starts with SIGXFSZ.
void FailBeyondFileSize();

}  // namespace weft
