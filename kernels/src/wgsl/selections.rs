//! Replaces small branches by selections. A compiler that follows each combination of branches in a
//! row, as SwiftShader's does, takes minutes for a kernel with many of them.

use naga::{
    Arena, Block, Expression, Function, Handle, LocalVariable, Module, Range, Span, Statement, TypeInner,
};

/// Maximum number of expressions that both sides of a branch compute for a selection.
const MOST: usize = 16;

/// Replaces branches whose sides only compute values of the same variables.
pub fn select(module: &mut Module) {
    let types = &module.types;
    let is_plain = |variable: Handle<LocalVariable>, function: &Function| {
        let of = &types[function.local_variables[variable].ty].inner;
        matches!(of, TypeInner::Scalar(_) | TypeInner::Vector { .. })
    };
    let functions = module.functions.iter_mut().map(|(_, function)| function);
    for function in functions.chain(module.entry_points.iter_mut().map(|entry| &mut entry.function)) {
        let mut body = std::mem::take(&mut function.body);
        let plain: Vec<bool> =
            function.local_variables.iter().map(|(variable, _)| is_plain(variable, function)).collect();
        convert(&mut body, &mut function.expressions, &plain);
        function.body = body;
    }
}

/// Side of a branch: ranges of expressions that it computes, and values that it stores.
#[derive(Default)]
struct Side {
    emits: Vec<Range<Expression>>,
    stores: Vec<(Handle<LocalVariable>, Handle<Expression>, Handle<Expression>)>,
    count: usize,
}

/// Returns what a side does, if it only computes plain values and stores them in variables.
fn side(block: &Block, expressions: &Arena<Expression>, plain: &[bool]) -> Option<Side> {
    let mut side = Side::default();
    for statement in block.iter() {
        match statement {
            Statement::Emit(range) => {
                if !range.clone().all(|of| is_pure(&expressions[of], expressions)) {
                    return None;
                }
                side.count += range.clone().count();
                side.emits.push(range.clone());
            }
            Statement::Store { pointer, value } => {
                let Expression::LocalVariable(variable) = expressions[*pointer] else { return None };
                let is_new = side.stores.iter().all(|(other, ..)| *other != variable);
                if !is_new || !plain[variable.index()] {
                    return None;
                }
                side.stores.push((variable, *pointer, *value));
            }
            _ => return None,
        }
        // A value that is read after a store is another one.
        if !side.stores.is_empty() && matches!(statement, Statement::Emit(_)) {
            return None;
        }
    }
    Some(side)
}

/// Returns whether an expression may be computed where it is not needed: it reads no memory but
/// variables, and costs little.
fn is_pure(expression: &Expression, expressions: &Arena<Expression>) -> bool {
    match expression {
        Expression::Load { pointer } => matches!(expressions[*pointer], Expression::LocalVariable(_)),
        Expression::Access { .. } => false,
        Expression::AccessIndex { base, .. } => {
            let base = &expressions[*base];
            !matches!(base, Expression::LocalVariable(_) | Expression::GlobalVariable(_)) && is_value(base)
        }
        Expression::Unary { .. }
        | Expression::Binary { .. }
        | Expression::Select { .. }
        | Expression::Compose { .. }
        | Expression::Splat { .. }
        | Expression::Swizzle { .. }
        | Expression::As { .. }
        | Expression::Math { .. } => true,
        _ => false,
    }
}

/// Returns whether an expression is surely a value, not a pointer to memory.
fn is_value(expression: &Expression) -> bool {
    !matches!(
        expression,
        Expression::Access { .. } | Expression::AccessIndex { .. } | Expression::FunctionArgument(_)
    )
}

fn convert(block: &mut Block, expressions: &mut Arena<Expression>, plain: &[bool]) {
    let mut kept = Block::new();
    for (statement, span) in std::mem::take(block).span_into_iter() {
        match statement {
            Statement::If { condition, mut accept, mut reject } => {
                convert(&mut accept, expressions, plain);
                convert(&mut reject, expressions, plain);
                let sides = (side(&accept, expressions, plain), side(&reject, expressions, plain));
                match sides {
                    (Some(yes), Some(no)) if is_small(&yes, &no) => {
                        replace(&mut kept, condition, (yes, no), expressions, span);
                    }
                    _ => kept.push(Statement::If { condition, accept, reject }, span),
                }
            }
            Statement::Block(mut inner) => {
                convert(&mut inner, expressions, plain);
                kept.push(Statement::Block(inner), span);
            }
            Statement::Loop { mut body, mut continuing, break_if } => {
                convert(&mut body, expressions, plain);
                convert(&mut continuing, expressions, plain);
                kept.push(Statement::Loop { body, continuing, break_if }, span);
            }
            Statement::Switch { selector, mut cases } => {
                cases.iter_mut().for_each(|case| convert(&mut case.body, expressions, plain));
                kept.push(Statement::Switch { selector, cases }, span);
            }
            other => kept.push(other, span),
        }
    }
    *block = kept;
}

/// Returns whether both sides store in the same variables, and compute little.
fn is_small(yes: &Side, no: &Side) -> bool {
    yes.count + no.count <= MOST
        && !yes.stores.is_empty()
        && yes.stores.len() == no.stores.len()
        && yes.stores.iter().all(|(variable, ..)| no.stores.iter().any(|(other, ..)| other == variable))
}

/// Computes both sides, and stores what the condition selects.
fn replace(
    kept: &mut Block,
    condition: Handle<Expression>,
    (yes, no): (Side, Side),
    expressions: &mut Arena<Expression>,
    span: Span,
) {
    for range in yes.emits.into_iter().chain(no.emits) {
        kept.push(Statement::Emit(range), span);
    }
    let mut stores = Vec::new();
    for (variable, pointer, accept) in yes.stores {
        let Some(&(_, _, reject)) = no.stores.iter().find(|(other, ..)| *other == variable) else { continue };
        let value = expressions.append(Expression::Select { condition, accept, reject }, span);
        kept.push(Statement::Emit(Range::new_from_bounds(value, value)), span);
        stores.push(Statement::Store { pointer, value });
    }
    stores.into_iter().for_each(|store| kept.push(store, span));
}
