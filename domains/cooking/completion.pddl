; Completes an observed state. For the scene parser only: the planner changes these predicates itself.
; What a gripper carries, be it a vegetable, the bowl or the knife, is not available to any other.
(define (domain cooking)
  (:derived (is-whole ?v - veggie)
    (not (is-sliced ?v)))
  (:derived (available ?o - movable)
    (not (exists (?g - gripper) (carry ?g ?o))))
  (:derived (free ?g - gripper)
    (not (exists (?o - movable) (carry ?g ?o)))))
