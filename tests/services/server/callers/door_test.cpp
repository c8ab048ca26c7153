// Connections of strangers and of those who are known, on a clock that stands until it is moved.
#include "services/server/callers/door.h"

#include <gtest/gtest.h>

#include <map>
#include <vector>

namespace weft {
namespace {

using std::chrono::seconds;

class DoorTest : public ::testing::Test {
 protected:
  // A connection of this peer. Those that are displaced leave.
  uint64_t Come(const std::string& peer) {
    const auto entry = door_.Enter(peer, now_);
    if (!entry) return 0;
    peers_[entry->place] = peer;
    if (entry->displaced) Go(*entry->displaced);
    return entry->place;
  }
  void Go(uint64_t place, bool timed_out = false) {
    door_.Leave(place, timed_out, now_);
    peers_.erase(place);
  }
  int OpenOf(const std::string& peer) const {
    int open = 0;
    for (const auto& [place, of] : peers_) open += of == peer ? 1 : 0;
    return open;
  }

  Door::Time now_{seconds(1000)};
  Door door_{{.all = 256, .kept = 128, .of_one_peer = 96}};
  std::map<uint64_t, std::string> peers_;
};

TEST_F(DoorTest, SilentConnectionsKeepNobodyOut) {
  for (int i = 0; i < 100; ++i) {
    for (const char* peer : {"10.0.0.1", "10.0.0.2", "10.0.0.3"}) Come(peer);
  }
  EXPECT_LE(door_.open(), 128);
  EXPECT_NE(Come("10.0.0.9"), 0U);
  EXPECT_EQ(OpenOf("10.0.0.9"), 1);
}

TEST_F(DoorTest, ManyPeersKeepNobodyOutEither) {
  for (int i = 0; i < 1000; ++i) {
    for (int of_peer = 0; of_peer < 3; ++of_peer)
      Come("10.0." + std::to_string(i / 250) + "." + std::to_string(i % 250));
  }
  EXPECT_LE(door_.open(), 128);
  for (int i = 0; i < 6; ++i) EXPECT_NE(Come("192.168.1.1"), 0U) << i;
}

TEST_F(DoorTest, WhoHasLessIsNotDisplacedByWhoHasMore) {
  const uint64_t modest = Come("10.0.0.9");
  for (int i = 0; i < 200; ++i) Come("10.0.0.1");
  EXPECT_TRUE(peers_.contains(modest));
  EXPECT_LE(OpenOf("10.0.0.1"), 96);
}

TEST_F(DoorTest, WhoIsKnownStaysAndLeavesAStrangersPlace) {
  std::vector<uint64_t> known;
  for (int i = 0; i < 30; ++i) {
    known.push_back(Come("10.0.0.1"));
    ASSERT_NE(known.back(), 0U);
    door_.Recognize(known.back(), "anna", now_);
  }
  for (int i = 0; i < 300; ++i) Come("10.0.0." + std::to_string(2 + i % 3));
  for (const uint64_t place : known) EXPECT_TRUE(peers_.contains(place));
  // Behind the same address as one that floods.
  for (int i = 0; i < 200; ++i) Come("10.0.0.1");
  const uint64_t again = Come("10.0.0.1");
  ASSERT_NE(again, 0U);
  door_.Recognize(again, "anna", now_);
  for (int i = 0; i < 200; ++i) Come("10.0.0.1");
  EXPECT_TRUE(peers_.contains(again));
}

TEST_F(DoorTest, OneWhoIsKnownDoesNotTakeAllPlaces) {
  for (int i = 0; i < 400; ++i) {
    if (const uint64_t place = Come("10.0.0.1")) door_.Recognize(place, "greedy", now_);
    now_ += seconds(1);
  }
  EXPECT_LE(door_.open(), 96 + 96);
  const uint64_t modest = Come("10.0.0.2");
  ASSERT_NE(modest, 0U);
  door_.Recognize(modest, "modest", now_);
  for (int i = 0; i < 100; ++i) Come("10.0.0.3");
  EXPECT_TRUE(peers_.contains(modest));
}

TEST_F(DoorTest, RequestsThatAreLeftUnfinishedKeepTheirPeerOut) {
  for (int i = 0; i < PeerBudget::kMostViolations; ++i) Go(Come("10.0.0.1"), true);
  EXPECT_EQ(Come("10.0.0.1"), 0U);
  EXPECT_NE(Come("10.0.0.2"), 0U);
  now_ += PeerBudget::kKeptOut;
  EXPECT_NE(Come("10.0.0.1"), 0U);
}

TEST_F(DoorTest, AProxyOfKnownOnesIsNotKeptOut) {
  door_.Recognize(Come("10.0.0.1"), "anna", now_);
  for (int i = 0; i < 10; ++i) Go(Come("10.0.0.1"), true);
  for (int i = 0; i < 1000; ++i) {
    const uint64_t place = Come("10.0.0.1");
    ASSERT_NE(place, 0U) << i;
    Go(place);
  }
  // Nobody was known there for a while.
  now_ += Door::kKnown;
  for (int i = 0; i < 300; ++i) Go(Come("10.0.0.1"));
  EXPECT_EQ(Come("10.0.0.1"), 0U);
}

TEST_F(DoorTest, PlacesComeBack) {
  std::vector<uint64_t> places;
  for (int round = 0; round < 100; ++round) {
    for (int i = 0; i < 20; ++i) {
      places.push_back(Come("10.0.0.1"));
      if (i % 2 == 0) door_.Recognize(places.back(), "anna", now_);
    }
    for (const uint64_t place : places) Go(place);
    places.clear();
    now_ += seconds(60);
  }
  EXPECT_EQ(door_.open(), 0);
  EXPECT_NE(Come("10.0.0.1"), 0U);
}

TEST_F(DoorTest, ALittleDoorCountsToTheLastPlace) {
  Door door({.all = 5, .kept = 2, .of_one_peer = 3});
  const auto enter = [&](const std::string& peer) { return door.Enter(peer, now_); };
  EXPECT_FALSE(door.Recognize(7, "nobody", now_)) << "there is no such place";
  door.Leave(7, true, now_);
  const auto first = enter("a");
  EXPECT_EQ(first->place, 1U);
  EXPECT_FALSE(first->displaced);
  const auto of_b = enter("b"), of_c = enter("c");
  EXPECT_EQ(of_c->place, 3U);
  EXPECT_EQ(door.open(), 3);
  // All places of strangers are taken: the oldest goes.
  const auto fourth = enter("d");
  EXPECT_EQ(fourth->displaced, first->place);
  EXPECT_FALSE(door.Recognize(first->place, "anna", now_)) << "it is to be ended";
  EXPECT_EQ(door.open(), 4);
  door.Leave(first->place, false, now_);
  // Its own goes first where it has as many as anybody.
  EXPECT_EQ(enter("c")->displaced, of_c->place);
  // Two of those who are known stand elsewhere, and leave their places.
  EXPECT_TRUE(door.Recognize(of_b->place, "anna", now_));
  EXPECT_TRUE(door.Recognize(of_b->place, "anna", now_)) << "once more";
  EXPECT_FALSE(enter("e")->displaced);
  EXPECT_TRUE(door.Recognize(fourth->place, "bert", now_));
  EXPECT_FALSE(enter("f")->displaced);
  const auto stays = enter("g");
  EXPECT_FALSE(door.Recognize(stays->place, "carl", now_)) << "there are two";
  door.Leave(of_b->place, false, now_);
  EXPECT_TRUE(door.Recognize(stays->place, "carl", now_));
}

TEST_F(DoorTest, WhoWasKnownIsLetInForTenMinutes) {
  door_.Recognize(Come("10.0.0.1"), "anna", now_);
  for (int i = 0; i < PeerBudget::kMostViolations; ++i) Go(Come("10.0.0.1"), true);
  now_ += Door::kKnown - std::chrono::nanoseconds(1);
  EXPECT_NE(Come("10.0.0.1"), 0U);
  for (int i = 0; i < PeerBudget::kMostViolations; ++i) Go(Come("10.0.0.1"), true);
  now_ += std::chrono::nanoseconds(1);
  for (int i = 0; i < PeerBudget::kMostViolations; ++i) Go(Come("10.0.0.1"), true);
  EXPECT_EQ(Come("10.0.0.1"), 0U);
}

}  // namespace
}  // namespace weft
