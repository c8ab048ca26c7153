#include "services/server/callers/door.h"

#include <utility>

namespace weft {
namespace {

Caller Visitor(const std::string& name) { return {name, v1::ROLE_VIEWER}; }

}  // namespace

Door::Door(const DoorLimits& limits)
    : strangers_({.all = limits.all - limits.kept, .of_one_caller = limits.of_one_peer}, "connections"),
      known_({.all = limits.kept, .of_one_caller = limits.of_one_peer}, "connections") {}

bool Door::IsKnown(const std::string& peer, Time now) const {
  const auto known = known_until_.find(peer);
  return known != known_until_.end() && now < known->second;
}

// The oldest stranger of the peer that has the most. None: all of them may stay.
std::optional<uint64_t> Door::Displace(const std::string& peer) {
  std::map<std::string, int> open;
  for (const auto& [id, place] : places_) {
    if (!place.is_known && !place.is_displaced) ++open[place.peer];
  }
  const int own = open.contains(peer) ? open[peer] : 0;
  auto most = open.end();
  for (auto it = open.begin(); it != open.end(); ++it) {
    if (most == open.end() || it->second > most->second) most = it;
  }
  if (most == open.end()) return std::nullopt;
  // Its own, unless that would take from those who have less.
  const std::string& loser = own > 0 && own + 1 >= most->second ? peer : most->first;
  for (auto& [id, place] : places_) {
    if (place.peer != loser || place.is_known || place.is_displaced) continue;
    place.is_displaced = true;
    strangers_.Give(place.peer);
    return id;
  }
  return std::nullopt;
}

std::optional<Door::Entry> Door::Enter(const std::string& peer, Time now) {
  if (!IsKnown(peer, now) && !budget_.Admit(peer, now)) return std::nullopt;
  Entry entry;
  if (!strangers_.Check(Visitor(peer)).ok()) {
    entry.displaced = Displace(peer);
    if (!entry.displaced) return std::nullopt;
  }
  entry.place = next_++;
  places_[entry.place] = {.peer = peer};
  strangers_.Take(peer);
  return entry;
}

bool Door::Recognize(uint64_t place, const std::string& account, Time now) {
  const auto found = places_.find(place);
  if (found == places_.end() || found->second.is_displaced) return false;
  std::erase_if(known_until_, [now](const auto& known) { return now >= known.second; });
  known_until_[found->second.peer] = now + kKnown;
  if (found->second.is_known) return true;
  if (!known_.Check(Visitor(account)).ok()) return false;
  found->second.is_known = true;
  found->second.account = account;
  strangers_.Give(found->second.peer);
  known_.Take(account);
  return true;
}

void Door::Leave(uint64_t place, bool timed_out, Time now) {
  const auto found = places_.find(place);
  if (found == places_.end()) return;
  const Place left = std::move(found->second);
  places_.erase(found);
  if (left.is_known) {
    known_.Give(left.account);
  } else if (!left.is_displaced) {
    strangers_.Give(left.peer);
  }
  if (timed_out && !IsKnown(left.peer, now)) budget_.Violate(left.peer, 1, now);
}

}  // namespace weft
