// SPDX-License-Identifier: BSD-3-Clause
//
// SUNDIALS: CVODE (Adams, BDF) and ARKODE's explicit Runge-Kutta methods, stopped where a gap
// closes by SUNDIALS' own root finding. Solvers are made once and reinitialised at events. ARKODE
// then chooses its first step itself.
//
// Written for SUNDIALS 6; link sundials_cvode, sundials_arkode, sundials_nvecserial,
// sundials_sunmatrixdense and sundials_sunlinsoldense.

#pragma once

#include <arkode/arkode_erkstep.h>
#include <cvode/cvode.h>
#include <nvector/nvector_serial.h>
#include <sundials/sundials_context.h>
#include <sunlinsol/sunlinsol_dense.h>
#include <sunmatrix/sunmatrix_dense.h>
#include <sunnonlinsol/sunnonlinsol_fixedpoint.h>

#include <algorithm>
#include <array>
#include <memory>
#include <type_traits>

namespace filippov::rivals {

enum class SundialsMethod {
    adams,           // CVODE, order up to 12, fixed-point iteration
    bdf,             // CVODE, order up to 5, Newton's method with the analytic Jacobian
    dormand_prince5, // ARKODE, ARKODE_DORMAND_PRINCE_7_4_5
    fehlberg8        // ARKODE, ARKODE_FEHLBERG_13_7_8
};

namespace detail {

template <auto release> struct Release {
    template <class T> void operator()(T* p) const { release(p); }
};
/// N_Vector, SUNMatrix and the like are names of pointers already.
template <class Pointer, auto release>
using Owned = std::unique_ptr<std::remove_pointer_t<Pointer>, Release<release>>;

inline void free_context(SUNContext context) { SUNContext_Free(&context); }
inline void free_cvode(void* memory) { CVodeFree(&memory); }
inline void free_erk(void* memory) { ERKStepFree(&memory); }
inline void free_linear(SUNLinearSolver solver) { SUNLinSolFree(solver); }
inline void free_nonlinear(SUNNonlinearSolver solver) { SUNNonlinSolFree(solver); }

using OwnedContext = Owned<SUNContext, &free_context>;
using OwnedVector = Owned<N_Vector, &N_VDestroy>;
using OwnedMatrix = Owned<SUNMatrix, &SUNMatDestroy>;
using OwnedLinear = Owned<SUNLinearSolver, &free_linear>;
using OwnedNonlinear = Owned<SUNNonlinearSolver, &free_nonlinear>;

inline OwnedContext make_context() {
    SUNContext context = nullptr;
    SUNContext_Create(nullptr, &context);
    return OwnedContext(context);
}

/// What CVODE and ARKODE call back: a field's `rates`, its `jacobian` column by column, and
/// `roots`, sought in `Field::root_directions`, over plain arrays; user data is the field.
template <class Field> struct SundialsCalls {
    static int field(double t, N_Vector x, N_Vector dxdt, void* field) {
        static_cast<const Field*>(field)->rates(t, N_VGetArrayPointer(x), N_VGetArrayPointer(dxdt));
        return 0;
    }

    static int roots(double t, N_Vector x, double* out, void* field) {
        static_cast<const Field*>(field)->roots(t, N_VGetArrayPointer(x), out);
        return 0;
    }

    static int jacobian(double t, N_Vector x, N_Vector, SUNMatrix J, void* field, N_Vector,
                        N_Vector, N_Vector) {
        static_cast<const Field*>(field)->jacobian(t, N_VGetArrayPointer(x), SM_DATA_D(J));
        return 0;
    }
};

struct SundialsStop {
    double t;
    bool at_root, failed;
    double h_next = 0; ///< the step that it would have tried next
};

/// The vector that SUNDIALS works on, and the field it sees.
template <class Field> struct SundialsProblem {
    OwnedContext context = make_context();
    Field field;
    OwnedVector x{N_VNew_Serial(Field::dim, context.get())};

    template <class State> void set(const State& from) {
        std::copy_n(from.data(), Field::dim, N_VGetArrayPointer(x.get()));
    }
    template <class State> State get() const {
        State to;
        std::copy_n(N_VGetArrayPointer(x.get()), Field::dim, to.data());
        return to;
    }
};

template <class Field> inline constexpr int n_roots = int(Field::root_directions.size());

template <class Field> class Cvode {
public:
    Cvode(SundialsMethod method, double tol)
        : is_adams_(method == SundialsMethod::adams),
          memory_(CVodeCreate(is_adams_ ? CV_ADAMS : CV_BDF, problem_.context.get())) {
        CVodeInit(memory_.get(), &SundialsCalls<Field>::field, 0.0, problem_.x.get());
        CVodeSStolerances(memory_.get(), tol, tol);
        CVodeSetUserData(memory_.get(), &problem_.field);
        CVodeSetMaxNumSteps(memory_.get(), -1);
        CVodeRootInit(memory_.get(), n_roots<Field>, &SundialsCalls<Field>::roots);
        auto directions = Field::root_directions;
        CVodeSetRootDirection(memory_.get(), directions.data());
        CVodeSetNoInactiveRootWarn(memory_.get());
        if (is_adams_)
            iterate_fixed_point();
        else
            iterate_newton();
    }

    SundialsProblem<Field>& problem() { return problem_; }

    template <class Count> SundialsStop go(double t, double t_end, Count& count, double = 0) {
        CVodeReInit(memory_.get(), t, problem_.x.get());
        CVodeSetStopTime(memory_.get(), t_end);
        int flag = CV_SUCCESS;
        do
            flag = CVode(memory_.get(), t_end, problem_.x.get(), &t, CV_NORMAL);
        while (flag == CV_ROOT_RETURN && !at_end());
        long n_steps = 0, n_rejected = 0, n_field = 0;
        CVodeGetNumSteps(memory_.get(), &n_steps);
        CVodeGetNumErrTestFails(memory_.get(), &n_rejected);
        CVodeGetNumRhsEvals(memory_.get(), &n_field);
        count.n_steps += n_steps;
        count.n_rejected += n_rejected;
        count.n_field += n_field;
        return {t, flag == CV_ROOT_RETURN, flag < 0};
    }

private:
    /// False of a root that ends nothing: integration goes on as if it had not stopped.
    bool at_end() const {
        std::array<int, Field::root_directions.size()> found{};
        CVodeGetRootInfo(memory_.get(), found.data());
        return Field::ends(found.data());
    }

    void iterate_fixed_point() {
        nonlinear_.reset(SUNNonlinSol_FixedPoint(problem_.x.get(), 0, problem_.context.get()));
        CVodeSetNonlinearSolver(memory_.get(), nonlinear_.get());
    }

    void iterate_newton() {
        SUNContext context = problem_.context.get();
        matrix_.reset(SUNDenseMatrix(Field::dim, Field::dim, context));
        linear_.reset(SUNLinSol_Dense(problem_.x.get(), matrix_.get(), context));
        CVodeSetLinearSolver(memory_.get(), linear_.get(), matrix_.get());
        CVodeSetJacFn(memory_.get(), &SundialsCalls<Field>::jacobian);
    }

    bool is_adams_;
    SundialsProblem<Field> problem_;
    OwnedNonlinear nonlinear_;
    OwnedMatrix matrix_;
    OwnedLinear linear_;
    Owned<void*, &free_cvode> memory_;
};

template <class Field> class Erk {
public:
    Erk(SundialsMethod method, double tol)
        : memory_(ERKStepCreate(&SundialsCalls<Field>::field, 0.0, problem_.x.get(),
                                problem_.context.get())) {
        ERKStepSetTableNum(memory_.get(), method == SundialsMethod::fehlberg8
                                              ? ARKODE_FEHLBERG_13_7_8
                                              : ARKODE_DORMAND_PRINCE_7_4_5);
        ERKStepSStolerances(memory_.get(), tol, tol);
        ERKStepSetUserData(memory_.get(), &problem_.field);
        ERKStepSetMaxNumSteps(memory_.get(), -1);
        ERKStepRootInit(memory_.get(), n_roots<Field>, &SundialsCalls<Field>::roots);
        auto directions = Field::root_directions;
        ERKStepSetRootDirection(memory_.get(), directions.data());
        ERKStepSetNoInactiveRootWarn(memory_.get());
    }

    SundialsProblem<Field>& problem() { return problem_; }

    template <class Count>
    SundialsStop go(double t, double t_end, Count& count, double first_step = 0) {
        ERKStepReInit(memory_.get(), &SundialsCalls<Field>::field, t, problem_.x.get());
        ERKStepSetInitStep(memory_.get(), first_step);
        ERKStepSetStopTime(memory_.get(), t_end);
        int flag = ARK_SUCCESS;
        do
            flag = ERKStepEvolve(memory_.get(), t_end, problem_.x.get(), &t, ARK_NORMAL);
        while (flag == ARK_ROOT_RETURN && !at_end());
        long n_steps = 0, n_rejected = 0, n_field = 0;
        ERKStepGetNumSteps(memory_.get(), &n_steps);
        ERKStepGetNumErrTestFails(memory_.get(), &n_rejected);
        ERKStepGetNumRhsEvals(memory_.get(), &n_field);
        count.n_steps += n_steps;
        count.n_rejected += n_rejected;
        count.n_field += n_field;
        double h_next = 0;
        ERKStepGetCurrentStep(memory_.get(), &h_next);
        return {t, flag == ARK_ROOT_RETURN, flag < 0, h_next};
    }

private:
    bool at_end() const {
        std::array<int, Field::root_directions.size()> found{};
        ERKStepGetRootInfo(memory_.get(), found.data());
        return Field::ends(found.data());
    }

    SundialsProblem<Field> problem_;
    Owned<void*, &free_erk> memory_;
};

} // namespace detail
} // namespace filippov::rivals
