// Messages whose texts are not UTF-8, which no reader of protobuf takes: one such text would hide the whole
// message.
#pragma once

#include <string>

#include "google/protobuf/message.h"

namespace weft {

// Texts that are not UTF-8 become escaped ones (capture/file/plain_text.h). All others stay as they are.
void EscapeTexts(google::protobuf::Message& message);

// As ParseFromString, and texts that are not UTF-8 become escaped ones. False: not such a message.
bool ParseWithEscapes(const std::string& bytes, google::protobuf::Message& message);

}  // namespace weft
