// The folder of a recorder.
#pragma once

#include <string>

namespace weft {

struct RecorderFiles {
  explicit RecorderFiles(const std::string& folder)
      : request(folder + "/request.json"),
        state(folder + "/state.json"),
        room(folder + "/state.json.room"),
        log(folder + "/recorder.log"),
        lock(folder + "/recorder.lock"),
        take(folder + "/take") {}

  std::string request;  // v1::RecorderRequest
  std::string state;    // v1::RecorderState
  std::string room;     // kept on the disk for the last state while the recorder lives
  std::string log;      // what the process printed
  std::string lock;     // held while the recorder lives; the process's number is in it
  std::string take;     // the take itself
};

}  // namespace weft
