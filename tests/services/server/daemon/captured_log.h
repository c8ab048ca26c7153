// What is logged while one of these lives.
#pragma once

#include <spdlog/sinks/base_sink.h>
#include <spdlog/spdlog.h>

#include <memory>
#include <mutex>
#include <string>
#include <vector>

namespace weft {

// Construct it before the threads that log, and destroy it after them.
class CapturedLog {
 public:
  CapturedLog() : sink_(std::make_shared<Sink>()) { spdlog::default_logger()->sinks().push_back(sink_); }
  ~CapturedLog() { spdlog::default_logger()->sinks().pop_back(); }
  CapturedLog(const CapturedLog&) = delete;
  CapturedLog& operator=(const CapturedLog&) = delete;

  // "LEVEL TEXT", one after the other.
  std::vector<std::string> Lines() const { return sink_->Lines(); }
  int Count(const std::string& words) const {
    int count = 0;
    for (const std::string& line : Lines()) count += line.find(words) != std::string::npos;
    return count;
  }

 private:
  class Sink final : public spdlog::sinks::base_sink<std::mutex> {
   public:
    std::vector<std::string> Lines() {
      const std::lock_guard lock(mutex_);
      return lines_;
    }

   private:
    void sink_it_(const spdlog::details::log_msg& message) override {
      const spdlog::string_view_t level = spdlog::level::to_string_view(message.level);
      lines_.push_back(std::string(level.data(), level.size()) + " " +
                       std::string(message.payload.data(), message.payload.size()));
    }
    void flush_() override {}
    std::vector<std::string> lines_;
  };

  const std::shared_ptr<Sink> sink_;
};

}  // namespace weft
