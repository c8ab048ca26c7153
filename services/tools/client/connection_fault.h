// Why a daemon cannot be spoken with, in the words of whoever can mend it.
#pragma once

#include <string>

#include "services/tools/client/channel.h"

namespace weft {

// What is wrong between this client and HOST:PORT beyond that nothing listens there, with its remedy: TLS on
// one side alone, or a certificate that expired, is not valid yet, is for another name, or that no authority
// known here vouches for. Empty: nothing of it was found. Connects once, without a call, for a few seconds at
// the most; `status` of gRPC 1.51 tells these apart in no stable words.
std::string FindConnectionFault(const std::string& server, const ClientIdentity& identity);

}  // namespace weft
