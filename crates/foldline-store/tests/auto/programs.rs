//! Equations and constants of AUTO-07p as models and studies: constructs of Fortran and C, boundary-value problems, connecting
//! orbits, and refusals with their lines.

use foldline_store::auto::{Program, Text, program};
use foldline_store::model_file::parse_model;
use foldline_store::study_file::parse_study;

const REST: &str =
    "      SUBROUTINE BCND\n      END SUBROUTINE BCND\n      SUBROUTINE ICND\n      END SUBROUTINE ICND\n";

fn translated(file: &str, text: &str, constants: &str) -> Result<Program, String> {
    let found = program(Text { file, text }, Text { file: "c.own", text: constants }, None, ["own", "own-model.toml"]);
    let found = found.map_err(|all| all[0].to_string())?;
    parse_model(&found.model, "own-model.toml").unwrap_or_else(|all| panic!("{}\n{}", all[0], found.model));
    parse_study(&found.study, "own.toml", &found.model, "own-model.toml").unwrap_or_else(|all| panic!("{}", all[0]));
    Ok(found)
}

#[track_caller]
fn has(text: &str, lines: &[&str]) {
    for line in lines {
        assert!(text.lines().any(|own| own == *line), "{line}\nis not in\n{text}");
    }
}

const CONSTANTS: &str =
    "NDIM= 3, IPS = 1, IRS = 0\nICP = ['k'], UZR = {'k': [0.5, 1.5]}\nparnames = {1: 'k'}\nRL0 = 0.0, RL1 = 2.0\n";

#[test]
fn loops_functions_and_integers_of_fortran_become_plain_equations() {
    let text = "! A ring.\n      SUBROUTINE FUNC(NDIM,U,ICP,PAR,IJAC,F,DFDU,DFDP)\n      IMPLICIT NONE\n      \
        INTEGER, INTENT(IN) :: NDIM, ICP(*), IJAC\n      DOUBLE PRECISION, INTENT(IN) :: U(NDIM), PAR(*)\n      \
        DOUBLE PRECISION F(NDIM), DFDU(NDIM,NDIM), DFDP(NDIM,*), g, z, half, rate(3)\n      INTEGER i, j\n      \
        g(z) = z*(1 - z)**2\n      half = 1/2 + 1.d0/2 + 3*2**(-1) + (-1)**(-2) - 2**0\n      DO i = 1, NDIM\n        j = MOD(i, NDIM) + 1\n        \
        CALL SPEED(U(i), PAR(1), &\n     &    rate(i))\n        F(i) = rate(i) - half*(U(i) - U(j))\n      ENDDO\n      \
        F(1) = F(1) + g(U(2))\n      IF(IJAC.EQ.0)RETURN\n      DFDU(1,1) = WHATEVER(U)\n      END SUBROUTINE FUNC\n      \
        SUBROUTINE SPEED(x, k, r)\n      DOUBLE PRECISION x, k, r, w\n      w = k*EXP(-x)\n      r = w - x/3.d0\n      END\n      \
        SUBROUTINE STPNT(NDIM,U,PAR,T)\n      INTEGER NDIM\n      DOUBLE PRECISION U(NDIM), PAR(*), T\n      PAR(1) = 4*ATAN(1.d0)\n      \
        U(1:3) = (/ 0.5d0, 0.d0, -1.d0 /)\n      END\n";
    let found = translated("own.f90", &format!("{text}{REST}"), CONSTANTS).unwrap();
    has(
        &found.model,
        &[
            "k = 3.141592653589793 # PAR(1)",
            "w = \"k*exp(-u1)\"",
            "w_v3 = \"k*exp(-u3)\"",
            "r_v3 = \"w_v3 - u3/3\"",
            "u1 = \"r - 0.5*(u1 - u2) + u2*(1 - u2)^2\"",
            "u3 = \"r_v3 - 0.5*(u3 - u1)\"",
        ],
    );
    has(&found.study, &["state = { u1 = 0.5, u2 = 0, u3 = -1 }", "free = \"k\"", "mark = { k = [0.5, 1.5] }"]);
}

#[test]
fn boundary_value_problems_keep_conditions_integrals_and_determined_parameters() {
    let text = "      SUBROUTINE FUNC(NDIM,U,ICP,PAR,IJAC,F,DFDU,DFDP)\n      DOUBLE PRECISION U(NDIM), PAR(*), F(NDIM)\n      F(1) = U(2)\n      \
        F(2) = -PAR(1)*EXP(U(1)) + PAR(2)\n      END\n      SUBROUTINE STPNT(NDIM,U,PAR,X)\n      DOUBLE PRECISION U(NDIM), PAR(*), X\n      \
        PAR(1) = 1\n      PAR(2) = 0\n      U(1) = X*(1 - X)\n      U(2) = 1 - 2*X\n      END\n      \
        SUBROUTINE BCND(NDIM,PAR,ICP,NBC,U0,U1,FB,IJAC,DBC)\n      DOUBLE PRECISION PAR(*), U0(NDIM), U1(NDIM), FB(NBC)\n      \
        FB(1) = U0(1)\n      FB(2) = U1(1) - PAR(3)*U0(2)**2\n      END\n      \
        SUBROUTINE ICND(NDIM,PAR,ICP,NINT,U,UOLD,UDOT,UPOLD,FI,IJAC,DINT)\n      DOUBLE PRECISION PAR(*), U(NDIM), FI(NINT)\n      \
        FI(1) = U(1) - 0.25d0\n      END\n";
    let constants =
        "NDIM = 2, IPS = 4, IRS = 0, NBC = 2, NINT = 1\nICP = [1, 2]\nunames = {1: 'temp'}\nNMX = 20, DSMAX = 0.1";
    let found = translated("own.f", text, constants).unwrap();
    has(
        &found.model,
        &[
            "solve = [\"p2\"]",
            "u2 = \"-(p1*exp(temp)) + p2\"",
            "condition_2 = \"temp@1 - p3*u2@0^2\"",
            "condition_1 = \"temp - 0.25\"",
        ],
    );
    has(
        &found.study,
        &[
            "state = { temp = \"t*(1 - t)\", u2 = \"1 - 2*t\" }",
            "range = [-1, 3] # edit as needed: NMX steps of DSMAX to both sides",
        ],
    );
}

#[test]
fn c_and_connecting_orbits_are_read() {
    let text = "#include \"auto_f2c.h\"\nextern struct { integer itwist, iequib; } blhom_1;\n/* A pulse\n   that travels. */\n\
        int func(integer ndim, const doublereal *u, const integer *icp, const doublereal *par, integer ijac, doublereal *f,\n\
        doublereal *dfdu, doublereal *dfdp)\n{\n    integer dim1 = ndim, i;\n    doublereal a;\n    a = dim1 = 2;\n    \
        for (i = 0; i < ndim; ++i) {\n        f[i] = 0.;\n    }\n    f[0] = u[1];\n    f[1] += par[0] * u[1] - pow(u[0], a);\n    \
        if (ijac == 0) {\n        return 0;\n    } else {\n        ARRAY2D(dfdu,0,0) = 0.;\n    }\n    return 0;\n}\n\
        int stpnt(integer ndim, doublereal t, doublereal *u, doublereal *par)\n{\n    par[0] = .25; par[1] = 3;\n    \
        if (blhom_1.iequib != 0) {\n        par[11] = 0.; par[12] = 0.;\n    }\n    return 0;\n}\n";
    let constants = "NDIM = 2, IPS = 9, ICP = [1, 2], IEQUIB = 1, NMX = 10, DSMAX = 0.1";
    let found = translated("own.c", text, constants).unwrap();
    has(&found.model, &["p1 = 0.25 # PAR(1)", "p2 = 3 # PAR(2)", "u2 = \"p1*u2 - u1^2\""]);
    has(&found.study, &["state = { u1 = 0, u2 = 0 }", "hold = \"homoclinic\"", "of = \"branch\"", "free = \"p2\""]);
}

#[test]
fn maps_and_rounded_numbers_are_noted() {
    let text = "      SUBROUTINE FUNC(NDIM,U,ICP,PAR,IJAC,F,DFDU,DFDP)\n      DOUBLE PRECISION U(NDIM), PAR(*), F(NDIM)\n      \
        F(1) = PAR(1)*U(1)*(1 - U(1))\n      END\n      SUBROUTINE STPNT(NDIM,U,PAR,T)\n      DOUBLE PRECISION U(NDIM), PAR(*), T\n      \
        PAR(1) = 0.1\n      U(1) = 0.5\n      END\n      SUBROUTINE PVLS(NDIM,U,PAR)\n      PAR(2) = GETP('NRM', 1, U)\n      END\n";
    let found = translated("own.f90", text, "NDIM=1, IPS=-1, ICP=[1]").unwrap();
    has(&found.model, &["u1 = {}", "[map]", "u1 = \"p1*u1*(1 - u1)\""]);
    assert!(found.notes.iter().any(|own| own.starts_with("line 10: PVLS is not translated")), "{:?}", found.notes);
    // 0.5 is exact in single precision.
    assert!(found.notes.iter().any(|own| own.starts_with("line 7: 1 numbers have no exponent D")), "{:?}", found.notes);
}

#[test]
fn what_has_no_counterpart_is_refused_with_its_line_and_a_cure() {
    let text = "      SUBROUTINE FUNC(NDIM,U,ICP,PAR,IJAC,F,DFDU,DFDP)\n      DOUBLE PRECISION U(NDIM), PAR(*), F(NDIM), a\n      a = 1\n      \
        F(1) = a*PAR(1) - U(1)\n      END\n      SUBROUTINE STPNT(NDIM,U,PAR,T)\n      DOUBLE PRECISION U(NDIM), PAR(*), T\n      \
        PAR(1) = 0\n      U(1) = 0\n      END\n      SUBROUTINE ICND(NDIM,PAR,ICP,NINT,U,UOLD,UDOT,UPOLD,FI,IJAC,DINT)\n      \
        DOUBLE PRECISION U(NDIM), UPOLD(NDIM), FI(NINT)\n      FI(1) = U(1)*UPOLD(1)\n      END\n";
    let usual = "NDIM=1, IPS=1, ICP=[1]";
    let cases: [(&str, &str, &str, &str, &str); 10] = [
        ("a = 1\n", "IF(U(1).GT.0) a = 1\n", usual, "a condition depends on states", "own.f90:3:7"),
        ("a = 1\n", "WRITE(6,*) U(1)\n", usual, "this statement is not translated: WRITE", "own.f90:3:7"),
        ("a = 1\n", "\n", usual, "`a` has no value here", "own.f90:4:7"),
        ("a = 1\n", "CALL OUTSIDE(U)\n", usual, "the subroutine `outside` is not in this file", "own.f90:3:7"),
        ("a = 1\n", "a = BESSEL(U(1))\n", usual, "`bessel` is neither an array nor a function", "own.f90:3:7"),
        ("a = 1\n", "a = MOD(U(1), 2.d0)\n", usual, "`mod` of states or parameters", "own.f90:3:7"),
        ("F(1)", "F(2)", usual, "the index 2 lies outside the array", "own.f90:4:7"),
        ("a = 1\n", "a = 1\n", "NDIM=1, IPS=5, ICP=[1]", "IPS = 5 optimises a functional", "c.own:1:1"),
        ("a = 1\n", "a = 1\n", "NDIM=2, IPS=1, ICP=[1]", "FUNC does not set F(2)", "own.f90:1:7"),
        (
            "a = 1\n",
            "a = 1\n",
            "NDIM=1, IPS=4, NBC=0, NINT=1, ICP=[1]",
            "the solution before (UOLD, UDOT or UPOLD)",
            "own.f90:11:7",
        ),
    ];
    for (from, to, constants, message, place) in cases {
        let said = translated("own.f90", &text.replacen(from, to, 1), constants).unwrap_err();
        assert!(
            said.contains(message) && said.contains(place) && said.contains("help: "),
            "{message}, {place}:\n{said}"
        );
    }
}
