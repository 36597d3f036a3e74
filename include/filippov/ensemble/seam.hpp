// SPDX-License-Identifier: BSD-3-Clause
// What modules that are compiled apart have to agree on, in words that they can compare.
//
// Lanes are compiled once for each instruction set; the scalar engine and the tapes are not. From
// one to the other go plain numbers, each at a place that no option of a compiler moves, and
// objects of the standard library and of classes with virtual functions, which some options do
// change
// (_GLIBCXX_DEBUG, -m32). Nothing of Eigen's is among them: how its vectors are aligned depends on
// the instruction set.
#pragma once

#include <filippov/ensemble/any_lanes.hpp>
#include <filippov/formulas/tape_system.hpp>
#include <filippov/version.hpp>

#include <array>
#include <cstddef>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace filippov {

/// Counts changes of what the same numbers mean: the order of codes, units, virtual functions.
inline constexpr int seam_format = 3;

/// A fact about the layout of what crosses: what it is of, and a number.
using SeamFact = std::pair<std::string, std::string>;

namespace detail {

#if defined(__GNUC__)
#pragma GCC diagnostic push
// every compiler that we know gives places in such classes too
#pragma GCC diagnostic ignored "-Winvalid-offsetof"
#endif

/// Facts as they are collected.
class SeamFacts {
public:
    void add(std::string what, std::string value) {
        all.emplace_back(std::move(what), std::move(value));
    }
    void add(std::string what, std::size_t value) { add(std::move(what), std::to_string(value)); }
    /// Size and alignment of a type.
    template <class T> void type(const std::string& name) {
        static_assert(alignof(T) <= alignof(std::max_align_t),
                      "filippov: what crosses has no vectors of registers");
        add("size of " + name, sizeof(T));
        add("alignment of " + name, alignof(T));
    }

    std::vector<SeamFact> all;
};

inline void add_library(SeamFacts& facts) {
    facts.type<void*>("pointer");
    facts.type<long long>("long long");
    facts.type<std::string>("std::string");
    facts.type<std::vector<double>>("std::vector");
    facts.type<std::span<double>>("std::span");
    facts.type<std::shared_ptr<const void>>("std::shared_ptr");
    facts.type<std::function<bool()>>("std::function");
    facts.type<std::array<double, 3>>("std::array of 3");
}

template <int N> void add_stretches(SeamFacts& facts) {
    constexpr int P = 32;
    static_assert(is_laid_out<N, 0>() && is_laid_out<N, 1>() && is_laid_out<N, P>());
    using Start = Stretch<N, P>;
    using End = StretchEnd<N>;
    const std::string of = " of " + std::to_string(N) + " components";
    facts.type<Start>("Stretch" + of);
    facts.add("Stretch::x" + of, offsetof(Start, x));
    facts.add("Stretch::p" + of, offsetof(Start, p));
    facts.type<End>("StretchEnd" + of);
    facts.add("StretchEnd::x" + of, offsetof(End, x));
    facts.type<StretchEvent<N>>("StretchEvent" + of);
    facts.add("StretchEvent::x" + of, offsetof(StretchEvent<N>, x));
}

/// What lanes are asked, and what they ask the scalar engine.
inline void add_runs(SeamFacts& facts) {
    [&]<int... N>(std::integer_sequence<int, N...>) {
        (add_stretches<N + 1>(facts), ...);
    }(std::make_integer_sequence<int, 9>());
    add_stretches<16>(facts);
    add_stretches<32>(facts);
    facts.type<Clock<double>>("Clock");
    facts.type<Worker>("Worker");
    facts.type<Parallel>("Parallel");
    facts.add("Parallel::cancelled", offsetof(Parallel, cancelled));
    facts.add("Parallel::progress", offsetof(Parallel, progress));
    facts.add("Parallel::total", offsetof(Parallel, total));
    facts.type<RunSettings>("RunSettings");
    facts.add("RunSettings::atol", offsetof(RunSettings, atol));
    facts.add("RunSettings::max_step", offsetof(RunSettings, max_step));
    facts.add("RunSettings::max_steps", offsetof(RunSettings, max_steps));
    facts.add("RunSettings::on_nonunique", offsetof(RunSettings, on_nonunique));
    facts.add("RunSettings::method", offsetof(RunSettings, method));
    facts.type<MemberView>("MemberView");
    facts.add("MemberView::p", offsetof(MemberView, p));
    facts.add("MemberView::t0", offsetof(MemberView, t0));
    facts.type<OutcomeView>("OutcomeView");
    facts.add("OutcomeView::clock", offsetof(OutcomeView, clock));
    facts.add("OutcomeView::x", offsetof(OutcomeView, x));
    facts.add("OutcomeView::mode", offsetof(OutcomeView, mode));
    facts.add("OutcomeView::slide_time", offsetof(OutcomeView, slide_time));
    facts.add("OutcomeView::steps", offsetof(OutcomeView, steps));
    facts.type<MemberEventView>("MemberEventView");
    facts.add("MemberEventView::before", offsetof(MemberEventView, before));
    facts.add("MemberEventView::clock", offsetof(MemberEventView, clock));
    facts.add("MemberEventView::x", offsetof(MemberEventView, x));
    facts.type<AnyPopulation>("AnyPopulation");
    facts.add("AnyPopulation::same_params", offsetof(AnyPopulation, same_params));
    facts.add("AnyPopulation::ends_at_exit", offsetof(AnyPopulation, ends_at_exit));
    facts.add("AnyPopulation::hears", offsetof(AnyPopulation, hears));
    facts.add("AnyPopulation::at_once", offsetof(AnyPopulation, at_once));
    facts.add("AnyPopulation::escape", offsetof(AnyPopulation, escape));
    facts.type<PopulationRun>("PopulationRun");
    facts.add("PopulationRun::counters", offsetof(PopulationRun, counters));
    facts.type<LaneCounters>("LaneCounters");
    facts.add("LaneCounters::width", offsetof(LaneCounters, width));
    facts.type<AnyScalar>("AnyScalar");
    facts.type<AnyLanes>("AnyLanes");
    facts.type<ScalarEngine<3, 32>>("ScalarEngine");
    facts.type<StretchListener<3>>("StretchListener");
}

/// What lanes read of a system of formulas.
inline void add_tapes(SeamFacts& facts) {
    facts.type<Instruction>("Instruction");
    facts.add("Instruction::slot", offsetof(Instruction, slot));
    facts.add("Instruction::a", offsetof(Instruction, a));
    facts.add("Instruction::k", offsetof(Instruction, k));
    facts.type<Operand>("Operand");
    facts.add("codes", std::size_t(Code::call) + 1);
    facts.type<Tape>("Tape");
    facts.type<External>("External");
    facts.add("External::dim", offsetof(External, dim));
    facts.add("External::value", offsetof(External, value));
    facts.add("External::jacobian", offsetof(External, jacobian));
    facts.add("External::scale", offsetof(External, scale));
    facts.type<SurfaceKind>("SurfaceKind");
    facts.type<TapeProgram>("TapeProgram");
    facts.add("TapeProgram::external", offsetof(TapeProgram, external));
    facts.add("TapeProgram::defaults", offsetof(TapeProgram, defaults));
    facts.add("TapeProgram::plane", offsetof(TapeProgram, plane));
    facts.add("TapeProgram::h", offsetof(TapeProgram, h));
    facts.add("TapeProgram::region", offsetof(TapeProgram, region));
    facts.add("TapeProgram::layer", offsetof(TapeProgram, layer));
    facts.add("TapeProgram::period", offsetof(TapeProgram, period));
    facts.add("TapeProgram::kind", offsetof(TapeProgram, kind));
    facts.add("TapeProgram::normal", offsetof(TapeProgram, normal));
    facts.add("TapeProgram::slide", offsetof(TapeProgram, slide));
    facts.add("TapeProgram::constant_slide", offsetof(TapeProgram, constant_slide));
    facts.add("TapeProgram::swing", offsetof(TapeProgram, swing));
}

#if defined(__GNUC__)
#pragma GCC diagnostic pop
#endif

} // namespace detail

/// All that two modules have to agree on before one hands anything to the other; the same on both
/// sides whatever instruction sets they are compiled for.
inline std::vector<SeamFact> seam_facts() {
    detail::SeamFacts facts;
    facts.add("version", FILIPPOV_VERSION);
    facts.add("format", std::size_t(seam_format));
    detail::add_library(facts);
    detail::add_runs(facts);
    detail::add_tapes(facts);
    return std::move(facts.all);
}

} // namespace filippov
