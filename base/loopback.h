// Which hosts are this machine.
#pragma once

#include <string>

namespace weft {

// "localhost", "[::1]", and addresses of 127.0.0.0/8 as four decimal numbers: no names that begin so, and
// none of the other ways to write an address.
bool IsLoopbackHost(const std::string& host);

}  // namespace weft
