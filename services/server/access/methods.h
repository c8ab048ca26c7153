// What the schemas say about methods.
#pragma once

#include <string>

#include "weft/v1/access.pb.h"

namespace weft {

enum class CallKind {
  kUnary,   // one question, one answer
  kStream,  // watches and downloads
  kUpload   // the client streams
};

struct Method {
  std::string name;                      // "Jobs.SubmitJob", for people
  v1::Role role = v1::ROLE_UNSPECIFIED;  // the least that may call it; unspecified: anybody
  CallKind kind = CallKind::kUnary;
  bool audited = false;  // whether audit.log records calls that were let in
  bool is_ours = false;  // a schema of weft has it; others have messages of their own kinds
};

// By the path of HTTP/2, for example "/weft.v1.Takes/StartTake". Health is for everybody. What no schema
// knows is for viewers, if it is not of weft, and for nobody below admin if it is.
Method MethodOf(const std::string& path);

}  // namespace weft
