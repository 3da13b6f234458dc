#include "drivers/standins/procedure/procedure_effects.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace perimap {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

Procedure one(Happening what, Duration at = seconds(10), Duration length = seconds(6)) {
  return {{{at, length, std::move(what)}}};
}

TEST(ProcedureEffects, NothingIsDoneOutsideAnEvent) {
  Procedure all;
  for (const Happening& what :
       {Happening(Withdrawn{}), Happening(Wiped{}), Happening(Fogged{}), Happening(Blood{}), Happening(Smoke{}),
        Happening(InstrumentSeen{}), Happening(Electrosurgery{}), Happening(Touch{}),
        Happening(Metal{{5.0, 0.0, 0.0}, 2.0}), Happening(ToolHidden{}), Happening(LeadsOff{})}) {
    all.events.push_back({seconds(10), seconds(6), what});
  }
  for (const Duration t : {Duration(0), Duration(milliseconds(9999)), Duration(seconds(16)), Duration(seconds(100))}) {
    const PictureState picture = picture_state(all, t);
    EXPECT_EQ(picture.trocar + picture.cloth + picture.fog + picture.smoke + picture.bands_levels, 0.0);
    EXPECT_TRUE(picture.blood.empty());
    EXPECT_TRUE(picture.shafts.empty());
    EXPECT_EQ(drawn_back_mm(all, t), 0.0);
    const TrackerTrouble trouble = tracker_trouble(all, t);
    EXPECT_FALSE(trouble.hidden);
    EXPECT_EQ(trouble.shift_mm, Vector3d::Zero());
    EXPECT_FALSE(leads_off(all, t));
    EXPECT_EQ(arc_mV(all, 1, t, 5), 0.0);
  }
}

TEST(ProcedureEffects, WhatIsDoneIsWholeInTheMiddleAndComesAndGoesSmoothly) {
  const Procedure fogged = one(Fogged{2.0});
  EXPECT_EQ(picture_state(fogged, seconds(13)).fog, 2.0);
  double before = 0.0;
  for (Duration t = seconds(9); t < seconds(17); t += milliseconds(20)) {
    const double fog = picture_state(fogged, t).fog;
    EXPECT_LT(std::abs(fog - before), 0.05) << to_seconds(t);
    before = fog;
  }
}

TEST(ProcedureEffects, AWithdrawnScopeSeesNothingButItsTrocar) {
  const Procedure procedure = one(Withdrawn{});
  EXPECT_EQ(drawn_back_mm(procedure, seconds(13)), 160.0);
  EXPECT_EQ(picture_state(procedure, seconds(13)).trocar, 1.0);
  // It still sees the organ when it has come back a little.
  EXPECT_EQ(picture_state(procedure, milliseconds(10300)).trocar, 0.0);
  EXPECT_GT(drawn_back_mm(procedure, milliseconds(10300)), 1.0);
}

TEST(ProcedureEffects, AScopeStaysAsItWasTurnedLast) {
  Procedure procedure = one(ScopeTurnedInHead{40.0, 1.0});
  procedure.events.push_back({seconds(30), seconds(2), ScopeTurnedInHead{-10.0, 1.5}});
  const ScopeAsHeld first{90.0, 1.0};
  EXPECT_EQ(turned_scope(procedure, first, seconds(5)).notch_deg, 90.0);
  EXPECT_EQ(turned_scope(procedure, first, seconds(20)).notch_deg, 40.0);
  EXPECT_EQ(turned_scope(procedure, first, seconds(40)).notch_deg, -10.0);
  EXPECT_EQ(turned_scope(procedure, first, seconds(40)).zoom, 1.5);
  EXPECT_NEAR(turned_scope(procedure, first, seconds(13)).notch_deg, 65.0, 1e-9);
  EXPECT_EQ(scope_turning(procedure, seconds(20)).turns, 1U);
  EXPECT_FALSE(scope_turning(procedure, seconds(20)).under_way);
  EXPECT_TRUE(scope_turning(procedure, seconds(31)).under_way);
  EXPECT_EQ(scope_turning(procedure, seconds(32)).turns, 2U);
}

TEST(ProcedureEffects, ArcsAreAsHighAsTheyAreSaidToBeAndManyAreHigherThanABeat) {
  const Procedure procedure = one(Electrosurgery{4.0, 40.0, 0.5, 0.0});
  double highest = 0.0;
  int crossings = 0;
  bool above = false;
  for (int sample = 3600; sample < 5760; ++sample) {
    const double mV = arc_mV(procedure, 3, from_seconds(sample / 360.0), sample);
    highest = std::max(highest, std::abs(mV));
    crossings += std::abs(mV) > 1.5 && !above ? 1 : 0;
    above = std::abs(mV) > 1.5;
  }
  EXPECT_LE(highest, 4.0 * 1.2);
  EXPECT_GT(highest, 2.5);
  EXPECT_GT(crossings, 10);
}

TEST(ProcedureEffects, MetalShiftsPosesAndElectrosurgeryShakesThem) {
  const TrackerTrouble metal = tracker_trouble(one(Metal{{5.0, -1.0, 0.0}, 3.0}), seconds(13));
  EXPECT_EQ(metal.shift_mm, Vector3d(5.0, -1.0, 0.0));
  EXPECT_NEAR(metal.turn_rad, 0.05236, 1e-5);
  EXPECT_EQ(tracker_trouble(one(Electrosurgery{4.0, 40.0, 0.5, 2.5}), seconds(13)).deviation_mm, 2.5);
}

TEST(ProcedureEffects, OnlyWhatLeavesHardlyAnythingToBeSeenHidesTheOrgan) {
  EXPECT_TRUE(hides_the_organ(Withdrawn{}));
  EXPECT_TRUE(hides_the_organ(Smoke{1.0}));
  EXPECT_FALSE(hides_the_organ(Smoke{0.9}));
  EXPECT_TRUE(hides_the_organ(Blood{0.5}));
  EXPECT_FALSE(hides_the_organ(Blood{0.4}));
  EXPECT_FALSE(hides_the_organ(InstrumentSeen{}));
  EXPECT_FALSE(hides_the_organ(Retraction{}));
  EXPECT_FALSE(hides_the_organ(ToolHidden{}));
}

}  // namespace
}  // namespace perimap
