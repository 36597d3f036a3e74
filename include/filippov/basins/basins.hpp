// SPDX-License-Identifier: BSD-3-Clause
// Basins of attraction of a forced system: attractors found, refined and fenced in, and every cell
// labelled by its own trajectory.
#pragma once

#include <filippov/basins/attractors.hpp>
#include <filippov/basins/detail/exit_lookup.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <random>
#include <span>
#include <string>
#include <vector>

namespace filippov {

/// How plain cell mapping labels the cells of one of its groups, beside the certified labels.
struct GroupCheck {
    std::int32_t group = 0; ///< of the plain map: an index, or `CellGrid::sink`, `unresolved`
    /// The attractor (from 1) of which a point lies in the group or next to it, 0: none, the group
    /// is spurious. Of several groups at one attractor the one with the largest basin stands for
    /// it; of several attractors at one group the one with the most of its cells.
    std::int32_t attractor = 0;
    std::vector<std::int64_t>
        cells{}; ///< that it takes, by certified label: escaped, unresolved, 1...
};

/// A picture of basins.
struct Basins {
    CellGrid grid;
    /// Shape (cells,): 1, 2, ... the attractor, 0 unresolved, -1 escaped.
    std::vector<std::int32_t> label{};
    /// Shape (cells,), empty if it is not wanted: the number of the flash, from 0, at which the
    /// trajectory had first landed, -1 where it did not. On an attractor that is not periodic: the
    /// first of the flashes at which it was seen there in a row.
    std::vector<std::int32_t> time{};
    /// Of the cell's run, why it is unresolved; `not_converged`: it did not land in `periods`.
    std::vector<Status> status{};
    std::vector<Attractor> attractors{}; ///< by period, then by their first point
    std::vector<StrobeCycle> saddles{};  ///< unstable cycles that were found
    CellMap plain{};                     ///< simple cell mapping of the same cells
    std::vector<GroupCheck>
        confusion{}; ///< one row a group of it, and those of sink and unresolved
    std::int64_t unresolved = 0;
    /// Cells, drawn at random, that were followed until a tenth of the ellipsoid and 1e-4 pictures
    /// from an attractor, and those of them that were not at the one of their label then.
    int audited = 0, disagreements = 0;
    bool by_exit = false;                   ///< the quotient was used
    std::string by_exit_reason{};           ///< why, or why not
    std::int64_t looked_up = 0;             ///< cells of which the label comes from it
    ExitBasins exits{};                     ///< the quotient, if it was built
    std::vector<std::int32_t> exit_label{}; ///< of each of its attractors: 1, 2, ..., 0 unresolved
    long long periods = 0; ///< forcing periods, begun, of all trajectories of the labelling
    LaneCounters counters{};
    /// `interrupted`: cells that were not labelled are unresolved; `not_converged`: the audit
    /// disagrees, see `audit_agrees`.
    Status state = Status::ok;
};

/// Whether an audit bears out the labels: no more cells disagree than the 0.6% that an audit of 500
/// cells without disagreement leaves open (with 95% confidence).
inline bool audit_agrees(int audited, int disagreements) {
    return disagreements <= 0.006 * audited;
}

/// Cells of a picture, one after the other.
struct CellRange {
    std::int32_t first = 0, count = 0;
};

/// Images of the centres of some cells after one period.
struct MappedCells {
    std::vector<std::int32_t> cell; ///< shape (count,): `CellGrid::sink` outside, `unresolved`
    std::vector<double> states;     ///< shape (count, dim)
    std::vector<Status> status;     ///< shape (count,)
    LaneCounters counters{};
    Status state = Status::ok; ///< `interrupted`: so are the cells that were not mapped
};

/// Labels of some cells: see Basins.
struct CellLabels {
    std::vector<std::int32_t> label, time; ///< shape (count,)
    std::vector<Status> status;            ///< shape (count,)
    long long periods = 0;                 ///< begun, those of the images among them
    std::int64_t looked_up = 0;            ///< cells of which the label comes from the quotient
    LaneCounters counters{};
    Status state = Status::ok; ///< `interrupted`: so are the cells that were not labelled
};

/// Finds what there is to fall to, and labels.
///
/// 1. Every centre is mapped by one period: the plain cell map. 2. Runs from random cells, from its
/// groups and from the attractors of the quotient, if it is to be used, settle; Newton's method
/// makes cycles of their ends. 3. Each is fenced in. 4. Every cell is followed on from its image
/// until it is inside a fence, or to its next exit from stick to slip, which is looked up.
/// 5. Random cells are followed on, to compare.
///
/// `run` does all of it. The parts are for who keeps or distributes what lies between them: images
/// and labels of cells do not depend on which cells are run together.
///
/// The result is the same for any number of threads, to the last bit in one build.
class BasinFinder {
public:
    /// @param system, lanes  of the same model; they must outlive the finder
    /// @error std::invalid_argument for a system that is not forced, or settings, parameters or a
    ///        grid that make no sense
    BasinFinder(const AnySystem& system, const AnyLanes& lanes, const CellGrid& grid, Vector p,
                BasinSettings settings = {})
        : picture_(system, lanes, grid, std::move(p), std::move(settings)) {}

    /// The whole picture.
    /// @error std::invalid_argument where the quotient is wanted (`always`) and does not apply
    /// @cost  a period a cell, and as many as it takes until it has landed or left a slide; memory
    ///        29 + 8 dim bytes a cell
    Basins run() {
        Basins basins{.grid = picture_.grid};
        const CellRange all{0, basins.grid.cells()};
        exits();
        MappedCells images = map_cells(all, half_of_progress(0), exits().state);
        basins.plain = cell_map(basins.grid, images.cell);
        LimitSets sets = find(basins.plain, images.state);
        basins.attractors = std::move(sets.attractors);
        basins.saddles = std::move(sets.saddles);
        CellLabels labels =
            label_cells(basins.attractors, all, images, half_of_progress(1), sets.state);
        basins.label = std::move(labels.label);
        basins.time = std::move(labels.time);
        basins.status = std::move(labels.status);
        basins.periods = labels.periods;
        basins.looked_up = labels.looked_up;
        basins.counters = images.counters;
        basins.counters += labels.counters;
        basins.state = labels.state;
        complete(basins);
        return basins;
    }

    /// Images of some cells.
    MappedCells images(CellRange cells) {
        require_range(cells);
        return map_cells(cells, picture_.settings.parallel, Status::ok);
    }
    /// Attractors and saddles, from the plain map of all cells.
    LimitSets find(const CellMap& plain) { return find(plain, Status::ok); }
    /// Labels of some cells, from their images.
    CellLabels labels(const std::vector<Attractor>& attractors, CellRange cells,
                      const MappedCells& images) {
        require_range(cells);
        const std::size_t n = std::size_t(cells.count), dim = std::size_t(picture_.unit.size());
        if (images.status.size() != n || images.states.size() != n * dim)
            detail::refuse("images.status.size()", double(images.status.size()),
                           "expected those of the cells");
        return label_cells(attractors, cells, images, picture_.settings.parallel, Status::ok);
    }
    /// What follows from a picture's labels, its plain map and its attractors: unresolved cells,
    /// an audit, and the confusion table. `state` becomes `interrupted` if the audit was, and
    /// `not_converged` if it disagrees.
    /// @error std::invalid_argument where sizes are not those of the grid
    void complete(Basins& basins) {
        const auto cells = std::size_t(picture_.grid.cells());
        if (basins.label.size() != cells || basins.plain.group.size() != cells)
            detail::refuse("basins.label.size()", double(basins.label.size()),
                           "expected the cells of the grid, as of basins.plain.group");
        basins.by_exit = exits().usable;
        basins.by_exit_reason = exits().reason;
        basins.exits = exits().basins;
        if (basins.by_exit)
            basins.exit_label = exit_labels(basins.attractors, basins.state);
        basins.unresolved = std::count(basins.label.begin(), basins.label.end(), 0);
        audit(basins);
        check(basins);
    }

private:
    void require_range(const CellRange& cells) const {
        if (!(cells.first >= 0 && cells.count >= 0 &&
              cells.first <= picture_.grid.cells() - cells.count))
            detail::refuse("cells.first", cells.first, "expected cells of the grid");
    }
    /// The quotient, built when it is first asked for.
    const detail::ExitLookup& exits() {
        if (!exits_)
            exits_.emplace(picture_, picture_.settings.quotient);
        return *exits_;
    }
    /// Of a run that shows every cell twice.
    Parallel half_of_progress(std::size_t half) const {
        Parallel parallel = picture_.settings.parallel;
        const auto n = std::size_t(picture_.grid.cells());
        if (parallel.progress)
            parallel.progress = [this, half, n](std::size_t done, std::size_t) {
                picture_.settings.parallel.progress(half * n + done, 2 * n);
            };
        return parallel;
    }

    // --- images --------------------------------------------------------------------------------

    class Images final : public detail::Flashes {
    public:
        Images(const detail::StrobePicture& picture, CellRange cells, MappedCells& images)
            : Flashes(picture), cells_(cells), images_(images) {}
        void member(std::size_t id, MemberView& m) override {
            start(m, detail::view(picture_.settings.rest), 1);
            picture_.put(picture_.grid.centre(cells_.first + std::int32_t(id)), m.x);
        }
        void take(std::size_t id, const OutcomeView& o) override {
            images_.status[id] = o.status;
            std::copy(o.x.begin(), o.x.end(),
                      images_.states.begin() + std::ptrdiff_t(id * o.x.size()));
            if (o.status == Status::escaped)
                images_.cell[id] = CellGrid::sink;
            if (o.status == Status::ok)
                images_.cell[id] = picture_.cell_of(o.x);
        }

    private:
        const CellRange cells_;
        MappedCells& images_;
    };
    MappedCells map_cells(CellRange cells, const Parallel& parallel, Status state) const {
        const auto n = std::size_t(cells.count);
        MappedCells images;
        images.state = state;
        images.cell.assign(n, CellGrid::unresolved);
        images.status.assign(n, Status::interrupted);
        images.states.assign(n * std::size_t(picture_.unit.size()), 0.0);
        Images run(picture_, cells, images);
        images.counters = picture_.run(n, run, picture_.settings.run, parallel, images.state);
        return images;
    }

    LimitSets find(const CellMap& plain, Status state) {
        return detail::AttractorFinder(picture_, state).find(plain, exits().flashed);
    }

    // --- labels --------------------------------------------------------------------------------

    /// Cells on their way from their images.
    class Cells final : public detail::Labelling {
    public:
        enum Exit : char { none, unknown, looked_up };
        std::vector<Exit> exit; ///< what the quotient said of each

        /// @param open         indices into the range
        /// @param exit_label   of the quotient's attractors
        /// @param exits        looks exits up; null: cells are followed until they have landed
        Cells(const detail::StrobePicture& picture, const MappedCells& images, CellLabels& labels,
              const std::vector<std::int32_t>& open, std::vector<detail::Progress> progress,
              const detail::Landings& landings, const detail::ExitLookup* exits,
              const std::vector<std::int32_t>& exit_label)
            : Labelling(picture, landings, std::move(progress), picture.settings.periods),
              exit(open.size(), none), images_(images), labels_(labels), open_(open), exits_(exits),
              exit_label_(exit_label) {
            ends_at_exit = exits != nullptr;
        }
        void member(std::size_t id, MemberView& m) override {
            start(m, state_at(images_, cell(id), picture_.unit.size()), 1, 1);
        }

    protected:
        void land(std::size_t id, std::int32_t label, const detail::Progress& at) override {
            BasinFinder::land(labels_, cell(id), label, at.time);
        }
        void end(std::size_t id, const OutcomeView& o) override {
            if (o.status == Status::event)
                look_up(id, o);
            else
                lose(labels_, cell(id), o.status);
        }

    private:
        std::size_t cell(std::size_t id) const { return std::size_t(open_[id]); }
        void look_up(std::size_t id, const OutcomeView& o) {
            const int attractor = exits_->attractor_at(o);
            const std::int32_t label = attractor > 0 ? exit_label_[std::size_t(attractor - 1)] : 0;
            exit[id] = label > 0 ? looked_up : unknown;
            if (label > 0)
                BasinFinder::land(labels_, cell(id), label, -1);
        }
        const MappedCells& images_;
        CellLabels& labels_;
        const std::vector<std::int32_t>& open_;
        const detail::ExitLookup* exits_;
        const std::vector<std::int32_t>& exit_label_;
    };
    static std::span<const double> state_at(const MappedCells& images, std::size_t cell,
                                            Eigen::Index dim) {
        return {images.states.data() + cell * std::size_t(dim), std::size_t(dim)};
    }
    static void land(CellLabels& labels, std::size_t cell, std::int32_t label, std::int32_t time) {
        labels.label[cell] = label;
        labels.status[cell] = Status::ok;
        if (!labels.time.empty())
            labels.time[cell] = time;
    }
    static void lose(CellLabels& labels, std::size_t cell, Status status) {
        labels.label[cell] = status == Status::escaped ? -1 : 0;
        labels.status[cell] = status == Status::ok ? Status::not_converged : status;
    }

    /// Cells without a label, as indices into their range, and how far they are.
    struct Open {
        std::vector<std::int32_t> cells{};
        std::vector<detail::Progress> progress{};
    };

    CellLabels label_cells(const std::vector<Attractor>& attractors, CellRange cells,
                           const MappedCells& images, const Parallel& parallel, Status state) {
        const auto n = std::size_t(cells.count);
        CellLabels labels;
        labels.state = state;
        labels.label.assign(n, 0);
        labels.status.assign(n, Status::interrupted);
        if (picture_.settings.times)
            labels.time.assign(n, -1);
        if (picture_.stopped(labels.state))
            return labels;
        const detail::Landings landings(attractors, picture_.unit, picture_.settings.distance,
                                        false);
        labels.periods = cells.count;
        Open open = begin(labels, cells, images, landings);
        if (exits().usable) {
            const auto exit_label = exit_labels(attractors, labels.state);
            follow(labels, images, landings, &exits(), exit_label, open, parallel);
        }
        follow(labels, images, landings, nullptr, {}, open, parallel);
        return labels;
    }
    /// Labels what has landed after no period or one, and lists the rest.
    Open begin(CellLabels& labels, CellRange cells, const MappedCells& images,
               const detail::Landings& landings) const {
        Open open;
        Vector x = picture_.settings.rest;
        const std::span<double> start{x.data(), std::size_t(x.size())};
        for (std::size_t cell = 0; cell < labels.label.size(); ++cell) {
            detail::Progress at;
            picture_.put(picture_.grid.centre(cells.first + std::int32_t(cell)), start);
            std::int32_t label = landings.visit(start, at);
            if (label == 0 && images.status[cell] == Status::ok) {
                ++at.periods;
                label = landings.visit(state_at(images, cell, x.size()), at);
            }
            if (label > 0) {
                land(labels, cell, label, at.time);
            } else if (images.status[cell] != Status::ok ||
                       at.periods >= picture_.settings.periods) {
                lose(labels, cell, images.status[cell]);
            } else {
                open.cells.push_back(std::int32_t(cell));
                open.progress.push_back(at);
            }
        }
        return open;
    }
    /// Labels cells, and leaves those that it could not look up.
    void follow(CellLabels& labels, const MappedCells& images, const detail::Landings& landings,
                const detail::ExitLookup* exits, const std::vector<std::int32_t>& exit_label,
                Open& open, const Parallel& how) const {
        const std::size_t n = labels.label.size(), before = n - open.cells.size();
        Parallel parallel = how;
        if (how.progress)
            parallel.progress = [&how, n, before](std::size_t done, std::size_t) {
                how.progress(before + done, n);
            };
        Cells run(picture_, images, labels, open.cells, open.progress, landings, exits, exit_label);
        const LaneCounters counters =
            picture_.run(open.cells.size(), run, picture_.settings.run, parallel, labels.state);
        if (!open.cells.empty())
            labels.counters += counters;
        // their images are counted
        labels.periods += run.periods() - static_cast<long long>(open.cells.size());
        labels.looked_up += std::count(run.exit.begin(), run.exit.end(), Cells::looked_up);
        Open left;
        for (std::size_t k = 0; k < open.cells.size(); ++k)
            if (run.exit[k] == Cells::unknown) {
                left.cells.push_back(open.cells[k]);
                left.progress.push_back(open.progress[k]);
            }
        open = std::move(left);
    }
    /// Attractors of the picture, from 1, that those of the quotient are; 0: not known.
    std::vector<std::int32_t> exit_labels(const std::vector<Attractor>& attractors, Status& state) {
        const detail::Landings landings(attractors, picture_.unit, picture_.settings.distance,
                                        false);
        std::vector<std::int32_t> found;
        for (const CellLabel& at : detail::label_points(picture_, exits().flashed, landings,
                                                        picture_.settings.periods, state))
            found.push_back(std::max(at.label, 0));
        return found;
    }

    // --- checks --------------------------------------------------------------------------------

    void audit(Basins& basins) const {
        if (picture_.stopped(basins.state))
            return;
        const BasinSettings& s = picture_.settings;
        std::mt19937_64 random(s.seed + 1);
        std::vector<std::size_t> cells;
        std::vector<Vector> points;
        for (int k = 0; k < s.audit; ++k) {
            cells.push_back(std::size_t(random() % std::uint64_t(picture_.grid.cells())));
            points.push_back(picture_.state(picture_.grid.centre(std::int32_t(cells.back()))));
        }
        const detail::Landings strict(basins.attractors, picture_.unit, s.distance, true);
        const auto found = detail::label_points(picture_, points, strict, s.periods, basins.state);
        if (basins.state != Status::ok)
            return;
        basins.audited = s.audit;
        for (std::size_t k = 0; k < cells.size(); ++k)
            basins.disagreements += found[k].label != basins.label[cells[k]];
        if (!audit_agrees(basins.audited, basins.disagreements))
            basins.state = Status::not_converged;
    }
    /// The plain map beside the labels.
    void check(Basins& basins) const {
        const std::size_t n = basins.plain.groups.size(), columns = basins.attractors.size() + 2;
        for (std::size_t g = 0; g < n + 2; ++g) {
            basins.confusion.push_back({.group = g < n    ? std::int32_t(g)
                                                 : g == n ? CellGrid::sink
                                                          : CellGrid::unresolved});
            basins.confusion.back().cells.assign(columns, 0);
        }
        for (std::size_t c = 0; c < basins.label.size(); ++c) {
            const std::int32_t group = basins.plain.group[c];
            const std::size_t k = group >= 0                ? std::size_t(group)
                                  : group == CellGrid::sink ? n
                                                            : n + 1;
            ++basins.confusion[k].cells[std::size_t(basins.label[c] + 1)];
        }
        for (std::size_t a = 0; a < basins.attractors.size(); ++a)
            if (const auto g = group_at(basins, basins.attractors[a])) {
                GroupCheck& row = basins.confusion[*g];
                if (row.attractor == 0 ||
                    row.cells[a + 2] > row.cells[std::size_t(row.attractor + 1)])
                    row.attractor = std::int32_t(a + 1);
            }
    }
    /// The group that stands for an attractor.
    std::optional<std::size_t> group_at(const Basins& basins, const Attractor& a) const {
        std::optional<std::size_t> best;
        for (std::size_t g = 0; g < basins.plain.groups.size(); ++g)
            if ((!best || basins.plain.groups[g].basin > basins.plain.groups[*best].basin) &&
                is_at(basins.plain.groups[g], a))
                best = g;
        return best;
    }
    bool is_at(const CellGroup& group, const Attractor& a) const {
        const auto next_to = [&](const Vector& x) {
            const std::int32_t n = picture_.grid.axis(1).n,
                               cell = picture_.cell_of(detail::view(x));
            return cell >= 0 &&
                   std::any_of(group.cells.begin(), group.cells.end(), [&](std::int32_t c) {
                       return std::abs(c / n - cell / n) <= 1 && std::abs(c % n - cell % n) <= 1;
                   });
        };
        const auto& points = a.periodic ? a.cycle.points : a.cloud;
        return std::any_of(points.begin(), points.end(), next_to);
    }

    detail::StrobePicture picture_;
    std::optional<detail::ExitLookup> exits_;
};

} // namespace filippov
