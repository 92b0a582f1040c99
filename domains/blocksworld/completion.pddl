; Completes an observed state. For the scene parser only: the planner changes these predicates itself.
; A held block stands nowhere and cannot be grasped.
(define (domain blocksworld)
  (:derived (ontable ?x - block)
    (and (not (holding ?x)) (not (exists (?y - block) (on ?x ?y)))))
  (:derived (clear ?x - block)
    (and (not (holding ?x)) (not (exists (?y - block) (on ?y ?x))))))
